"""A gateway with access control, and the keys of its callers."""

from collections.abc import Callable, Coroutine, Mapping, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, Final

from gateway.access.credentials import Credentials
from gateway.access.keys import KeyStore
from gateway.access.roles import Role
from tests.api.stand import Stand, build_stand
from tests.virtual_time import run_virtual

LINES: Final = {"arm": [{"id": "00"}, {"id": "01"}, {"id": "3F"}], "leg": [{"id": "00"}, {"id": "70"}]}
GROUPS: Final = {
    "arm": [{"id": "80", "members": ["01", "3F"]}],
    "leg": [{"id": "81", "members": ["00", "70"]}],
}


class Keys:
    """The keys of a test, each made when it is first asked for."""

    def __init__(self, folder: Path) -> None:
        self.now = 1_000_000.0
        self.store = KeyStore(folder, lambda: self.now)
        self.credentials = Credentials(self.store, clock=lambda: self.now)
        self._made: dict[tuple[Role, tuple[str, ...] | None], str] = {}

    def of(self, role: Role | str, *scope: str) -> str:
        """A key of a role, for everything where no scope is named."""
        wanted = Role(role), scope or None
        if wanted not in self._made:
            name = "-".join((wanted[0], *scope)).replace("/", "-")
            self._made[wanted] = self.store.create(name, *wanted)
        return self._made[wanted]

    def header(self, role: Role | str, *scope: str) -> dict[str, str]:
        return {"authorization": f"Bearer {self.of(role, *scope)}"}


Story = Callable[[Stand, Keys], Coroutine[Any, Any, None]]


def guarded(
    access: Mapping[str, object] | None = None, **server: object
) -> Callable[[Story], Callable[[], None]]:
    """Turn a story about a guarded gateway into a test that runs it in virtual time."""

    def as_test(story: Story) -> Callable[[], None]:
        def test() -> None:
            async def run(folder: str) -> None:
                keys = Keys(Path(folder))
                async with build_stand(LINES, server, access or {}, keys.credentials, GROUPS) as stand:
                    await story(stand, keys)

            with TemporaryDirectory() as folder:
                run_virtual(run(folder))

        return test

    return as_test


def written(stand: Stand) -> Sequence[int]:
    """Number of pieces that were written to each line."""
    return [len(port.written) for port in stand.ports.values()]
