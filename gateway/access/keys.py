"""Keys: made once, shown once, kept as hashes in one file that the command line and the gateway share."""

import fcntl
import json
import logging
import os
import re
import secrets
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from datetime import UTC, datetime
from hashlib import sha256
from hmac import compare_digest
from pathlib import Path
from stat import S_ISVTX, S_IWOTH
from typing import Final, Literal

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from gateway.access.principal import Principal
from gateway.access.roles import Role
from gateway.core.records import Record
from protocols.wording import as_given

log = logging.getLogger(__name__)

FILE: Final = "keys.json"
_USES: Final = "keys-used.json"
_LOCK: Final = "keys.lock"
_NAME: Final = re.compile(r"[A-Za-z0-9][A-Za-z0-9._@-]{0,63}")
_SCOPE: Final = re.compile(r"(?:[a-z][a-z0-9-]{0,31}[.])?[0-9A-Fa-f]{2}|[a-z][a-z0-9-]{0,31}")
_RESERVED: Final = frozenset({"gateway", "everybody"})
RECHECK_S: Final = 0.05
"""The file is looked at no more often for keys that are known: it takes a third of the time of the check."""
LONGEST_S: Final = 10 * 365 * 86_400.0
"""No key that ends lasts longer."""
_OTHERS_MAY_WRITE: Final = 0o022


class KeyFault(ValueError):
    """A key cannot be made, found or read; the message says why and what to do."""


class KeyWordFault(KeyFault):
    """What is asked for is no name, no scope or no time."""


class KeyFileFault(KeyFault):
    """The file of the keys cannot be read or written."""


class KeyInfo(Record):
    """A key, without what is secret of it."""

    name: str
    role: Role
    scope: list[str] | None = Field(
        description="The addresses of lines, bodies, groups and robots that it is for; null means all."
    )
    begins: str = Field(description="How the key begins, which is no secret.")
    state: Literal["good", "expired", "revoked"]
    made_at: datetime
    expires_at: datetime | None
    revoked_at: datetime | None
    used_at: datetime | None = Field(description="When it was last used, as the gateway notes once a minute.")


class Key(BaseModel):
    """What is kept of a key: enough to know it again, and not to make it."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    name: str
    role: Role
    scope: tuple[str, ...] | None = None
    """Addresses of lines, bodies, groups and robots; None means everything."""
    prefix: str
    """The part of the key that is no secret."""
    sha256: str
    created: float
    """Wall time, seconds since 1970, as all times of a key."""
    expires: float | None = None
    revoked: float | None = None

    def is_good_at(self, now: float) -> bool:
        """Whether it can be used."""
        return self.revoked is None and (self.expires is None or now < self.expires)

    def state_at(self, now: float) -> Literal["good", "expired", "revoked"]:
        """Say whether it can be used, and if not, why."""
        if self.revoked is not None:
            return "revoked"
        return "good" if self.is_good_at(now) else "expired"

    def told_at(self, now: float, used: float | None) -> KeyInfo:
        """What is no secret of it."""
        return KeyInfo(
            name=self.name,
            role=self.role,
            scope=None if self.scope is None else list(self.scope),
            begins=f"mg_{self.prefix}",
            state=self.state_at(now),
            made_at=datetime.fromtimestamp(self.created, UTC),
            expires_at=_utc(self.expires),
            revoked_at=_utc(self.revoked),
            used_at=_utc(used),
        )

    def principal(self) -> Principal:
        """Its holder."""
        scope = None if self.scope is None else frozenset(self.scope)
        return Principal(self.name, self.role, scope, self.prefix)


def _utc(at: float | None) -> datetime | None:
    return None if at is None else datetime.fromtimestamp(at, UTC)


class _File(BaseModel):
    model_config = ConfigDict(extra="forbid")

    keys: list[Key] = []


class KeyStore:
    """The keys in a data directory; the file is read again whenever it is another one.

    A key that another process makes is good at once, one that it revokes is not after `RECHECK_S`.
    """

    def __init__(self, directory: Path, clock: Callable[[], float] = time.time) -> None:
        self._directory = directory
        self._path = directory / FILE
        self._place = os.fspath(self._path)
        self._clock = clock
        self._look_at = 0.0
        self._seen: tuple[int, int, int] | None = None
        self._keys: dict[str, Key] = {}
        self._used: dict[str, float] = {}
        self._used_since = False

    # what the gateway asks

    def verify(self, token: str) -> Key | None:
        """Find the key that a text is, if it can be used now."""
        prefix = token[3:].partition("_")[0]
        if prefix not in self._keys or time.monotonic() >= self._look_at:
            self._look()
        key = self._keys.get(prefix)
        digest = sha256(token.encode("utf-8", "surrogateescape")).hexdigest()
        if key is None or not compare_digest(key.sha256, digest):
            return None
        now = self._clock()
        if not key.is_good_at(now):
            return None
        self._used[prefix] = now
        self._used_since = True
        return key

    def has(self, key: Key) -> bool:
        """Whether a key that was verified before can still be used."""
        self._look()
        known = self._keys.get(key.prefix)
        return (known is key or known == key) and key.is_good_at(self._clock())

    def knows(self, key: Key) -> bool:
        """Whether it is as it was when the file was last looked at, and can be used."""
        return self._keys.get(key.prefix) is key and key.is_good_at(self._clock())

    @property
    def is_empty(self) -> bool:
        """Whether there is no key that can be used."""
        self._look()
        now = self._clock()
        return not any(key.is_good_at(now) for key in self._keys.values())

    def keep_uses(self) -> None:
        """Write down when each key was last used, if one was since; takes the time of a small file."""
        if self._used_since:
            self._used_since = False
            self._write(_USES, json.dumps({**self.uses(), **self._used}))

    # what an administrator asks

    def all(self) -> Sequence[Key]:
        """All keys, those that cannot be used any more too, oldest first.

        :raises KeyFileFault: the file cannot be read, or others may write it.
        """
        return self._read().keys

    def infos(self) -> Sequence[KeyInfo]:
        """The same, without what is secret of them."""
        uses, now = {**self.uses(), **self._used}, self._clock()
        return [key.told_at(now, uses.get(key.prefix)) for key in self.all()]

    def uses(self) -> dict[str, float]:
        """When keys were last used, by their prefixes; the gateway writes it down once a minute."""
        try:
            return {str(prefix): float(at) for prefix, at in json.loads(self._text(_USES)).items()}
        except (OSError, ValueError, AttributeError, TypeError):
            return {}

    def create(
        self, name: str, role: Role, scope: Sequence[str] | None = None, expires_s: float | None = None
    ) -> str:
        """Make a key and give it; nobody can read it again.

        :raises KeyWordFault: the name, the scope or the time is none.
        :raises KeyFault: a good key has this name.
        :raises KeyFileFault: the file cannot be written.
        """
        if not _NAME.fullmatch(name) or name.lower() in _RESERVED:
            raise KeyWordFault(
                f"{name!r} is no name of a key: up to 64 letters, digits and . _ @ -, and neither gateway "
                "nor everybody."
            )
        for address in scope or ():
            if not _SCOPE.fullmatch(address):
                raise KeyWordFault(f"{address!r} is no address of a line, body, group or robot.")
        if expires_s is not None and not 0 < expires_s <= LONGEST_S:
            raise KeyWordFault("A key ends within 10 years, or never.")
        prefix = secrets.token_hex(6)
        token = f"mg_{prefix}_{secrets.token_urlsafe(32)}"
        now = self._clock()
        key = Key(
            name=name,
            role=role,
            scope=None if scope is None else tuple(scope),
            prefix=prefix,
            sha256=sha256(token.encode()).hexdigest(),
            created=now,
            expires=None if expires_s is None else now + expires_s,
        )
        with self._changing() as file:
            if any(it.name == name and it.is_good_at(now) for it in file.keys):
                raise KeyFault(f"There is a good key {name} already; revoke it first, or take another name.")
            file.keys.append(key)
        return token

    def revoke(self, name: str) -> None:
        """Let no key of this name be used any more.

        :raises KeyFault: there is no good one.
        :raises KeyFileFault: the file cannot be written.
        """
        now = self._clock()
        with self._changing() as file:
            good = [key for key in file.keys if key.name == name and key.is_good_at(now)]
            if not good:
                raise KeyFault(f"There is no good key {as_given(name)}.")
            file.keys = [it.model_copy(update={"revoked": now}) if it in good else it for it in file.keys]

    # the file

    def _look(self) -> None:
        """Read the file if it is another one; one that cannot be read leaves what is known."""
        self._look_at = time.monotonic() + RECHECK_S
        try:
            status = os.stat(self._place)  # noqa: PTH116  # half the time, at every request
        except FileNotFoundError:
            self._keys, self._seen = {}, None
            return
        except OSError as error:
            log.warning("%s cannot be looked at: %s", self._path, error.strerror)
            return
        seen = status.st_mtime_ns, status.st_ino, status.st_size
        if seen == self._seen:
            return
        self._seen = seen
        try:
            self._keys = {key.prefix: key for key in self._read().keys}
        except KeyFault as error:
            log.warning("The keys stay as they were: %s", error)
        except Exception:
            self._seen = None
            log.exception("The keys stay as they were, and are read again")

    def _read(self) -> _File:
        try:
            if self._path.is_symlink():
                raise KeyFileFault(f"{self._path} is a symbolic link: put the file itself there.")
            if self._path.stat().st_mode & _OTHERS_MAY_WRITE:
                raise KeyFileFault(f"Others may write {self._path}: chmod 600 it, and look at who is in it.")
            if self._directory.stat().st_mode & (S_IWOTH | S_ISVTX) == S_IWOTH:
                raise KeyFileFault(
                    f"Everybody may put other files into {self._directory}: chmod 700 it, and look at who is "
                    f"in {FILE}."
                )
            return _File.model_validate_json(self._text(FILE))
        except FileNotFoundError:
            return _File()
        except OSError as error:
            raise KeyFileFault(f"{self._path} cannot be read: {error.strerror}.") from error
        except (ValidationError, UnicodeDecodeError):
            raise KeyFileFault(f"{self._path} is no file of keys.") from None

    def _text(self, name: str) -> str:
        return (self._directory / name).read_text("utf-8")

    @contextmanager
    def _changing(self) -> Iterator[_File]:
        """Change the file alone, and all of it or nothing."""
        try:
            self._directory.mkdir(mode=0o700, parents=True, exist_ok=True)
            lock = os.open(self._directory / _LOCK, os.O_CREAT | os.O_RDWR | os.O_CLOEXEC, 0o600)
            try:
                fcntl.flock(lock, fcntl.LOCK_EX)
                file = self._read()
                yield file
                self._write(FILE, file.model_dump_json(indent=1))
            finally:
                os.close(lock)
            self._look()
        except OSError as error:
            raise KeyFileFault(
                f"The keys in {self._directory} cannot be changed: {error.strerror}."
            ) from error

    def _write(self, name: str, text: str) -> None:
        new = self._directory / f".{name}.{secrets.token_hex(4)}"
        descriptor = os.open(new, os.O_CREAT | os.O_EXCL | os.O_WRONLY | os.O_CLOEXEC, 0o600)
        with os.fdopen(descriptor, "w", encoding="utf-8") as file:
            if os.geteuid() == 0:  # what root makes is the gateway's to read
                owner = self._directory.stat()
                os.fchown(descriptor, owner.st_uid, owner.st_gid)
            file.write(text)
            file.flush()
            os.fsync(file.fileno())
        new.replace(self._directory / name)
