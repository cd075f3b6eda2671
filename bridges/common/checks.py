"""Tries what a bridge's file says of the gateway: whether it answers, and what each key may."""

from collections.abc import Callable
from functools import partial
from typing import Final

from motion_gateway_client import GatewayError

from bridges.common.callers import Caller, Doors
from bridges.common.settings import BridgeFile, key_in

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
    keys = {"gateway.key_file": file.gateway.key_file}
    keys |= {f"callers.{name}.key_file": table.key_file for name, table in file.callers.items()}
    for place, key_file in keys.items():
        caller = Caller(doors, partial(key_in, key_file))
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
