"""Tries what a bridge's file says of the gateway: whether it answers, and what each key may."""

from collections.abc import Callable
from typing import Final

from motion_gateway_client import GatewayError

from bridges.common.callers import Caller, Doors
from bridges.common.settings import BridgeFile, secret_in

READ_BY_OTHERS: Final = 0o077
Say = Callable[[str], object]


async def check(file: BridgeFile, say: Say) -> list[str]:
    """Ask the gateway who each key is; gives what is wrong, a sentence each."""
    doors = Doors(file.gateway)
    troubles = [
        f"{path}: others may read it; chmod 600 {path}"
        for path in file.secret_files
        if path.stat().st_mode & READ_BY_OTHERS
    ]
    own = file.gateway.key_file
    readers = {"gateway.key_file": (lambda: secret_in(own)) if own else (lambda: None)}
    readers |= {
        f"callers.{name}.key_file": (lambda path=table.key_file: secret_in(path))
        for name, table in file.callers.items()
    }
    for place, read in readers.items():
        caller = Caller(doors, read)
        try:
            answer = await caller.ask("GET", "/system/identity")
        except GatewayError as error:
            return [*troubles, f"gateway.url: {error}"]
        finally:
            await caller.aclose()
        if not answer.is_success:
            troubles.append(f"{place}: the gateway refuses it: {answer.content.get('detail', answer.status)}")
            continue
        who = answer.content
        say(f"{place}: {who['name']}, role {who['role']}, for {_scope(who['scope'])}")
        if place.startswith("gateway.") and who["scope"] is not None:
            troubles.append(f"{place}: has a scope; the bridge's own key has to see the whole plant")
    return troubles


def _scope(scope: list[str] | None) -> str:
    return "everything" if scope is None else ", ".join(scope)
