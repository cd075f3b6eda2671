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
from functools import partial
from hashlib import sha256
from hmac import compare_digest
from pathlib import Path
from stat import S_ISVTX, S_IWOTH
from typing import Final, Literal

from pydantic import BaseModel, ConfigDict, Field, JsonValue, ValidationError

from gateway.access.principal import Principal
from gateway.access.roles import Role
from gateway.core.records import Record
from gateway.core.supervisor import do_each
from protocols.wording import as_given

log = logging.getLogger(__name__)

FILE: Final = "keys.json"
_USES: Final = "keys-used.json"
_POLICY: Final = "keys-policy.json"
_LOCK: Final = "keys.lock"
_NAME: Final = re.compile(r"[A-Za-z0-9][A-Za-z0-9._@-]{0,63}")
_SCOPE: Final = re.compile(r"(?:[a-z][a-z0-9-]{0,31}[.])?[0-9A-Fa-f]{2}|[a-z][a-z0-9-]{0,31}")
_RESERVED: Final = frozenset({"gateway", "everybody"})
RECHECK_S: Final = 0.05
"""The file is looked at no more often for keys that are known: it takes a third of the time of the check."""
LONGEST_S: Final = 10 * 365 * 86_400.0
"""Longest lifetime of a key that ends, in seconds."""
DAY_S: Final = 86_400.0
OVERLAP_S: Final = 7 * DAY_S
"""Default time for which a rotated key stays good beside the new one, in seconds."""
State = Literal["good", "expired", "revoked", "waiting"]
_OTHERS_MAY_WRITE: Final = 0o022


class KeyFault(ValueError):
    """A key cannot be made, found or read; the message says why and what to do."""


class KeyWordFault(KeyFault):
    """The name, scope or time that was asked for is not valid."""


class KeyFileFault(KeyFault):
    """The file of the keys cannot be read or written."""


class KeyPolicy(BaseModel):
    """The rules for the keys of a data directory, written down by the gateway for the command line."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    lifetime_s: float | None = 365 * DAY_S
    """Seconds for which a key is good if its creator names no time; None means for ever."""
    warning_s: float = 30 * DAY_S
    """Seconds before its end at which a key is warned of."""
    four_eyes: bool = False
    """True if a second admin has to approve the key of an admin, as soon as there are two."""


class KeyInfo(Record):
    """A key, without what is secret of it."""

    name: str
    role: Role
    scope: list[str] | None = Field(
        description="Addresses of the lines, bodies, groups and robots that the key is for; null means all."
    )
    begins: str = Field(description="Beginning of the key, which is no secret.")
    state: State = Field(
        description="State of the key; `waiting`: an admin's key that no second admin has approved yet "
        "(`access.four_eyes`)."
    )
    ends_soon: bool = Field(
        description="True if the key ends within `access.key_warning_d`, and no newer key has its name."
    )
    made_by: str | None = Field(description="The caller who made the key over HTTP, if that was noted.")
    approved_by: str | None
    made_at: datetime
    expires_at: datetime | None
    revoked_at: datetime | None
    used_at: datetime | None = Field(description="Time at which the key was last used, noted once a minute.")


class Key(BaseModel):
    """A stored key: enough to recognise it, not enough to make it."""

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
    made_by: str | None = None
    needs_approval: bool = False
    approved_by: str | None = None

    def is_good_at(self, now: float) -> bool:
        """Say whether the key can be used at `now`."""
        return self.state_at(now) == "good"

    def state_at(self, now: float) -> State:
        """Say whether it can be used, and if not, why."""
        if self.revoked is not None:
            return "revoked"
        if self.expires is not None and now >= self.expires:
            return "expired"
        return "waiting" if self.needs_approval and self.approved_by is None else "good"

    def told_at(self, now: float, used: float | None, *, ends_soon: bool) -> KeyInfo:
        """Give the part of the key that is no secret."""
        return KeyInfo(
            name=self.name,
            role=self.role,
            scope=None if self.scope is None else list(self.scope),
            begins=f"mg_{self.prefix}",
            state=self.state_at(now),
            ends_soon=ends_soon,
            made_by=self.made_by,
            approved_by=self.approved_by,
            made_at=datetime.fromtimestamp(self.created, UTC),
            expires_at=_utc(self.expires),
            revoked_at=_utc(self.revoked),
            used_at=_utc(used),
        )

    def principal(self) -> Principal:
        """The holder of the key."""
        scope = None if self.scope is None else frozenset(self.scope)
        return Principal(self.name, self.role, scope, self.prefix)


def _utc(at: float | None) -> datetime | None:
    return None if at is None else datetime.fromtimestamp(at, UTC)


class _File(BaseModel):
    model_config = ConfigDict(extra="forbid")

    keys: list[Key] = []


_IN_FORCE: Final = frozenset({"good", "waiting"})


def _new(
    name: str, role: Role, scope: Sequence[str] | None, now: float, expires_s: float | None
) -> tuple[str, Key]:
    """A new secret, and what is kept of it."""
    prefix = secrets.token_hex(6)
    token = f"mg_{prefix}_{secrets.token_urlsafe(32)}"
    return token, Key(
        name=name,
        role=role,
        scope=None if scope is None else tuple(scope),
        prefix=prefix,
        sha256=sha256(token.encode()).hexdigest(),
        created=now,
        expires=None if expires_s is None else now + expires_s,
    )


def _kept(key: Key) -> dict[str, JsonValue]:
    """Give the JSON that is stored of a key; earlier versions do not know the fields of a second admin."""
    unused = {name for name in ("made_by", "needs_approval", "approved_by") if not getattr(key, name)}
    return key.model_dump(mode="json", exclude=unused)


def _with(keys: Sequence[Key], some: Sequence[Key], **changed: object) -> list[Key]:
    """The keys, with something else in some of them."""
    return [key.model_copy(update=changed) if key in some else key for key in keys]


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
        return self.verify_digest(
            token[3:].partition("_")[0], sha256(token.encode("utf-8", "surrogateescape")).hexdigest()
        )

    def verify_digest(self, prefix: str, digest: str) -> Key | None:
        """Find the key of a prefix and a hash, if it can be used now: good enough for a stop, and no more."""
        if prefix not in self._keys or time.monotonic() >= self._look_at:
            self._look()
        key = self._keys.get(prefix)
        if key is None or not compare_digest(key.sha256, digest):
            return None
        now = self._clock()
        if not key.is_good_at(now):
            return None
        self._used[prefix] = now
        self._used_since = True
        return key

    def good(self, name: str) -> Key | None:
        """Find the newest key of a name that can be used now: who shows a certificate acts with it."""
        self._look()
        now = self._clock()
        found = [key for key in self._keys.values() if key.name == name and key.is_good_at(now)]
        if not found:
            return None
        self._used[found[-1].prefix] = now
        self._used_since = True
        return found[-1]

    def has(self, key: Key) -> bool:
        """Say whether a key that was verified before is good; reads the key file if it has changed."""
        self._look()
        known = self._keys.get(key.prefix)
        return (known is key or known == key) and key.is_good_at(self._clock())

    def knows(self, key: Key) -> bool:
        """Say whether the key is unchanged since the file was last read, and can be used."""
        return self._keys.get(key.prefix) is key and key.is_good_at(self._clock())

    @property
    def is_empty(self) -> bool:
        """True if there is no key that can be used."""
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
        """All keys without their secrets."""
        uses, now, before = {**self.uses(), **self._used}, self._clock(), self.policy().warning_s
        keys = self.all()
        newest = {key.name: key for key in keys}
        return [
            key.told_at(
                now,
                uses.get(key.prefix),
                ends_soon=newest[key.name] is key
                and key.is_good_at(now)
                and key.expires is not None
                and key.expires - now <= before,
            )
            for key in keys
        ]

    def policy(self) -> KeyPolicy:
        """The rules for the keys: the defaults until a gateway has served from this directory.

        :raises KeyFileFault: it cannot be read.
        """
        try:
            return KeyPolicy.model_validate_json(self._text(_POLICY))
        except FileNotFoundError:
            return KeyPolicy()
        except (OSError, ValueError):
            raise KeyFileFault(f"{self._directory / _POLICY} cannot be read.") from None

    def adopt(self, policy: KeyPolicy) -> None:
        """Write down what holds for the keys, where that is something else than before.

        :raises KeyFileFault: it cannot be written.
        """
        try:
            if (self._directory / _POLICY).exists() and self.policy() == policy:
                return
            self._directory.mkdir(mode=0o700, parents=True, exist_ok=True)
            self._write(_POLICY, policy.model_dump_json())
        except OSError as error:
            raise KeyFileFault(f"{self._directory / _POLICY} cannot be written: {error.strerror}.") from error

    def uses(self) -> dict[str, float]:
        """When keys were last used, by their prefixes; the gateway writes it down once a minute."""
        try:
            return {str(prefix): float(at) for prefix, at in json.loads(self._text(_USES)).items()}
        except (OSError, ValueError, AttributeError, TypeError):
            return {}

    def create(
        self,
        name: str,
        role: Role,
        scope: Sequence[str] | None = None,
        expires_s: float | None = None,
        *,
        by: str | None = None,
    ) -> str:
        """Make a key and give it, by the admin of a name; without a time it has no end.

        It cannot be read again. Where four eyes are wanted, an admin's key is good when a second admin, not
        the one who made it, has approved it.

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
        now = self._clock()
        token, key = _new(name, role, scope, now, expires_s)
        with self._changing() as file:
            if any(key.name == name and key.state_at(now) in _IN_FORCE for key in file.keys):
                raise KeyFault(f"There is a good key {name} already; revoke it first, or take another name.")
            waits = role is Role.ADMIN and self._wants_two(file.keys, now, by)
            if waits and by is None:
                raise KeyFault(
                    "A key of an admin takes two admins here (access.four_eyes): use POST /access/keys."
                )
            file.keys.append(key.model_copy(update={"made_by": by, "needs_approval": waits}))
        return token

    def _wants_two(self, keys: Sequence[Key], now: float, by: str | None) -> bool:
        """Say whether the key of an admin needs a second admin: it does if two admins could approve.

        If an admin asks, who may have ended the keys of all others, every admin counts whose key was ever
        good. At the machine, where `by` is None, those count whose keys are good now.
        """
        admins = {
            key.name
            for key in keys
            if key.role is Role.ADMIN
            and key.scope is None
            and (key.is_good_at(now) if by is None else not key.needs_approval or key.approved_by is not None)
        }
        return len(admins) > 1 and self.policy().four_eyes

    def approve(self, name: str, by: str) -> None:
        """Let a key that waits for a second admin be good.

        :raises KeyWordFault: the same admin has made it.
        :raises KeyFault: no key of this name waits.
        :raises KeyFileFault: the file cannot be written.
        """
        now = self._clock()
        with self._changing() as file:
            waiting = [key for key in file.keys if key.name == name and key.state_at(now) == "waiting"]
            if not waiting:
                raise KeyFault(f"No key {as_given(name)} waits for a second admin.")
            if waiting[-1].made_by == by:
                raise KeyWordFault(
                    f"{by} has made the key {name}: another admin has to approve it. "
                    "Where there is none, make a key at the gateway's machine (`motion-gateway keys create`)."
                )
            file.keys = _with(file.keys, waiting, approved_by=by)

    def rotate(self, name: str, overlap_s: float = OVERLAP_S, *, by: str | None = None) -> str:
        """Make a new key in the place of a good one, and give it; the old one is good for the overlap yet.

        The new one has its name, role and scope, and lasts as long as the old one was to last in all.

        :raises KeyWordFault: the overlap is none.
        :raises KeyFault: there is no good key of this name, or it is another admin's, and takes two.
        :raises KeyFileFault: the file cannot be written.
        """
        if not 0 <= overlap_s <= LONGEST_S:
            raise KeyWordFault("The old key is good for 10 years more at most.")
        now = self._clock()
        with self._changing() as file:
            good = [key for key in file.keys if key.name == name and key.is_good_at(now)]
            if not good:
                raise KeyFault(f"There is no good key {as_given(name)}.")
            old = good[-1]
            if old.role is Role.ADMIN and by != name and self._wants_two(file.keys, now, by):
                raise KeyFault(
                    f"{name} is an admin, whose new key another would have alone (access.four_eyes): "
                    "rotate it with that key itself, or make one of another name."
                )
            lasts_s = self.policy().lifetime_s if old.expires is None else old.expires - old.created
            token, key = _new(name, old.role, old.scope, now, lasts_s)
            ended = [key for key in good if key.expires is None or key.expires > now + overlap_s]
            file.keys = [
                *_with(file.keys, ended, expires=now + overlap_s),
                key.model_copy(update={"made_by": by}),
            ]
        return token

    def revoke(self, name: str) -> None:
        """Let no key of this name be used any more.

        :raises KeyFault: there is no good one.
        :raises KeyFileFault: the file cannot be written.
        """
        now = self._clock()
        with self._changing() as file:
            good = [key for key in file.keys if key.name == name and key.state_at(now) in _IN_FORCE]
            if not good:
                raise KeyFault(f"There is no good key {as_given(name)}.")
            file.keys = _with(file.keys, good, revoked=now)

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
        if seen != self._seen:
            self._seen = None
            do_each("the reading of the keys", partial(self._read_anew, seen))

    def _read_anew(self, seen: tuple[int, int, int]) -> None:
        """Read the file as it was seen; after a fault the keys stay, and it is read again."""
        try:
            self._keys = {key.prefix: key for key in self._read().keys}
        except KeyFault as error:
            log.warning("The keys stay as they were: %s", error)
        self._seen = seen

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
                self._write(FILE, json.dumps({"keys": list(map(_kept, file.keys))}, indent=1))
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
