"""Attempts of hostile clients: all are refused, nothing goes over a line, and stops work throughout."""

import random
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Final

from protocols.rorze.commands import COMMANDS
from protocols.rorze.row import LinkMasterCommand
from protocols.table import Effect
from tests.api.access.guarded import Keys, guarded, written
from tests.api.stand import HOST, RELATIVE, Socket, Stand

CHUNK: Final = 50
"""Requests that are refused between two stops."""
MOVE: Final = "/bodies/arm.3F/moves"


@dataclass(frozen=True)
class Attempt:
    """A request that must not be carried out, and what it is answered with."""

    path: str
    headers: Mapping[str, str]
    status: int
    method: str = "POST"
    content: object = field(default_factory=lambda: RELATIVE)


def bad_credentials(keys: Keys) -> Iterator[str]:
    """Headers that are nearly right."""
    good = keys.of("admin")
    prefix, secret = good[3:15], good[16:]
    (stored,) = (key for key in keys.store.all() if key.prefix == prefix)
    yield from (
        "",
        "Bearer",
        "Bearer ",
        "Bearer  ",
        f"Basic {good}",
        good,
        f"Bearer {good} {good}",
        f"Token {good}",
    )
    yield from (f"Bearer mg_{prefix}_{stored.sha256}", f"Bearer {stored.sha256}", f"Bearer {prefix}")
    yield from (f"Bearer {good[:-1]}", f"Bearer {good}x", f"Bearer {good.upper()}", f"Bearer mg_{secret}")
    yield from (f"Bearer mg__{secret}", f"Bearer mg_{prefix}_", f"Bearer mg_*_{secret}", "Bearer null")
    yield from (
        f"Bearer MG_{prefix}_{secret}",
        f"Bearer '{good}'",
        f"Bearer {good},{good}",
        "Bearer e30.e30.e30",
    )
    yield from ("Bearer " + "a" * 5000, "Bearer mg_\xff_\xe9", "Bearer mg_" + "_" * 300, "Negotiate abc")
    chance = random.Random(1)
    for _ in range(60):
        place = chance.randrange(16, len(good))
        letter = chance.choice([it for it in "abcXYZ019-" if it != good[place]])
        yield f"Bearer {good[:place]}{letter}{good[place + 1 :]}"


def wrong_credentials(keys: Keys) -> Iterator[Attempt]:
    shown = [*bad_credentials(keys)]
    for path in (MOVE, "/groups/80/moves", "/bodies/arm.3F/commands/move-clockwise"):
        for header in shown:
            yield Attempt(path, {"authorization": header}, 401)
    yield from (Attempt("/stop", {"authorization": header}, 401) for header in shown)


def ended_credentials(keys: Keys) -> Iterator[Attempt]:
    lapsed = keys.store.create("lapsed", "admin", expires_s=10)  # type: ignore[arg-type]  # a role's word
    revoked = keys.store.create("revoked", "admin")  # type: ignore[arg-type]
    keys.store.revoke("revoked")
    keys.now += 11
    for path in (MOVE, "/stop", "/groups/80/moves", "/bodies/arm.3F/raw", "/bodies/arm.3F/stop"):
        yield Attempt(path, {"authorization": f"Bearer {lapsed}"}, 401)
        yield Attempt(path, {"authorization": f"Bearer {revoked}"}, 401)


def too_little_right(keys: Keys) -> Iterator[Attempt]:
    for path in (MOVE, "/groups/80/moves", "/bodies/arm.3F/speed", "/bodies/arm.3F/power-cycle/acknowledge"):
        yield Attempt(path, keys.header("viewer"), 403)
    for role in ("viewer", "operator"):
        for row in COMMANDS.values():
            if row.effect in (Effect.SETTING, Effect.MAINTENANCE) and not issubclass(row, LinkMasterCommand):
                yield Attempt(f"/bodies/arm.3F/commands/{row.name()}", keys.header(role), 403)
        yield Attempt("/bodies/arm.3F/position", keys.header(role), 403, "PUT")
        yield Attempt("/bodies/arm.3F/raw", keys.header(role), 403, content={"text": "1+M5"})
        yield Attempt("/groups/82", keys.header(role), 403, "PUT", {"members": ["arm.00", "arm.3F"]})
        yield Attempt("/lines/arm/scans", keys.header(role), 403)


def confused_deputies(keys: Keys) -> Iterator[Attempt]:
    """Keys that are good for something else, by every name that the thing has."""
    elsewhere = [("leg",), ("leg.70",), ("leg.81",), ("arm.01",), ("arm.00", "leg"), ("nowhere",), ("00",)]
    names = ("arm.3F", "3F", "3f", "ARM.3F", "Arm.3f", "arm.3f")
    for scope in elsewhere:
        header = keys.header("admin", *scope)
        for name in names:
            yield Attempt(f"/bodies/{name}/moves", header, 403)
            yield Attempt(f"/bodies/{name}/commands/move-clockwise", header, 403)
        for name in ("80", "arm.80", "ARM.80"):
            yield Attempt(f"/groups/{name}/moves", header, 403)
            yield Attempt(f"/groups/{name}", header, 403, "PUT", {"members": ["leg.00", "leg.70"]})
        yield Attempt("/lines/arm/scans", header, 403)
        yield Attempt("/lines/arm/trace", header, 403, "GET")
        yield Attempt("/bodies/7F/moves", header, 403)
    # Who may set up some bodies makes a group of them and others, to move those through it.
    some = keys.header("setup", "arm.01", "arm.00")
    for members in (["00", "3F"], ["arm.01", "arm.3F"], ["3F", "3F"], ["leg.00", "leg.70"], ["arm.99", "00"]):
        yield Attempt("/groups/arm.85", some, 403, "PUT", {"members": members})
        yield Attempt("/groups/85", some, 403, "PUT", {"members": members})
        yield Attempt("/groups/arm.80", some, 403, "PUT", {"members": members})
    for members in (["leg.00", "leg.70"], ["leg.70", "leg.00"]):
        yield Attempt("/groups/arm.85", keys.header("setup", "arm"), 403, "PUT", {"members": members})


def keys_in_wrong_places(keys: Keys) -> Iterator[Attempt]:
    good = keys.of("admin")
    for query in ("key", "token", "access_token", "api_key", "ticket", "authorization"):
        yield Attempt(f"{MOVE}?{query}={good}", {}, 401)
        yield Attempt(f"/stop?{query}={good}", {}, 401)
    for name in ("x-api-key", "proxy-authorization", "x-authorization", "cookie"):
        yield Attempt(MOVE, {name: good}, 401)
        yield Attempt(MOVE, {name: f"Bearer {good}"}, 401)
    for name in ("x-forwarded-for", "x-real-ip", "forwarded", "x-forwarded-user", "x-forwarded-host"):
        yield Attempt(MOVE, {name: "127.0.0.1"}, 401)


def foreign_pages(keys: Keys) -> Iterator[Attempt]:
    """Good keys, in requests that a foreign page, or a page behind a rebound name, would send."""
    header = keys.header("admin")
    for origin in (
        "http://evil.example",
        "null",
        "http://127.0.0.1:3000",
        f"http://{HOST}.evil.example",
        "file://",
    ):
        for path in (MOVE, "/stop", "/groups/80/moves", "/tickets"):
            yield Attempt(path, {**header, "origin": origin}, 403)
    hosts = (
        "evil.example",
        "127.0.0.1.evil.example:8420",
        "127.0.0.1@evil.example",
        "gateway",
        "",
        "0.0.0.0:8420",
    )
    for host in hosts:
        for path in (MOVE, "/stop", "/bodies/arm.3F/raw"):
            yield Attempt(path, {**header, "host": host}, 403)


def signed_in_browsers(keys: Keys, session: str) -> Iterator[Attempt]:
    """Attempts with a signed-in browser's cookie, sent by other sites, and with sessions never begun."""
    cookie = {"cookie": f"mg-session={session}"}
    sites: Sequence[Mapping[str, str]] = (
        {},
        {"sec-fetch-site": "same-site"},
        {"sec-fetch-site": "cross-site"},
        {"sec-fetch-site": "none"},
        {"origin": "http://127.0.0.1:3000"},
        {"origin": "http://localhost:8420"},
        {"origin": f"http://{HOST}", "sec-fetch-site": "same-site"},
        {"origin": "null", "sec-fetch-site": "same-origin"},
    )
    for path in (MOVE, "/stop", "/groups/80/moves", "/bodies/arm.3F/raw", "/tickets", "/sign-out"):
        yield from (Attempt(path, {**cookie, **site}, 403) for site in sites)
    own = {"origin": f"http://{HOST}", "sec-fetch-site": "same-origin"}
    for guess in ("", "x", session[:-1], session.swapcase(), f"{session}x", keys.of("admin"), "0" * 43):
        yield Attempt(MOVE, {"cookie": f"mg-session={guess}", **own}, 401)
        yield Attempt(MOVE, {"cookie": f"__Host-mg-session={session}", **own}, 401)
        yield Attempt(MOVE, {**cookie, "authorization": f"Basic {guess}", **own}, 401)


async def refused(stand: Stand, attempt: Attempt) -> None:
    headers = [(name.encode(), value.encode("latin-1")) for name, value in attempt.headers.items()]
    answer = await stand.client.request(attempt.method, attempt.path, json=attempt.content, headers=headers)
    assert answer.status_code == attempt.status, (attempt, answer.text)
    assert answer.json()["moved"] == "no"


async def stop_works(stand: Stand, keys: Keys) -> None:
    before = written(stand)
    answer = await stand.post("/bodies/arm.3F/stop", **keys.header("viewer", "leg.00"))
    assert answer.status_code == 200
    assert answer.json()["confirmed"]
    assert written(stand)[0] > before[0]


@guarded(raw_commands=True)
async def test_hundreds_of_hostile_requests_do_nothing_and_stops_work_throughout(
    stand: Stand, keys: Keys
) -> None:
    grant = keys.credentials.verify(keys.of("admin"))
    assert grant is not None
    session = stand.app.access.sessions.begin(grant)
    attempts = [
        *wrong_credentials(keys),
        *too_little_right(keys),
        *confused_deputies(keys),
        *keys_in_wrong_places(keys),
        *foreign_pages(keys),
        *signed_in_browsers(keys, session),
        *ended_credentials(keys),
    ]
    random.Random(0).shuffle(attempts)
    assert len(attempts) >= 500
    for first in range(0, len(attempts), CHUNK):
        await stop_works(stand, keys)
        before = written(stand)
        for attempt in attempts[first : first + CHUNK]:
            await refused(stand, attempt)
        assert written(stand) == before
    assert stand.moved() == []


@guarded()
async def test_a_ticket_opens_one_stream_once_and_soon(stand: Stand, keys: Keys) -> None:
    async def ticket(*scope: str) -> str:
        answer = await stand.post("/tickets", **keys.header("viewer", *scope))
        assert answer.headers["cache-control"] == "no-store"
        return str(answer.json()["ticket"])

    async def handshake(target: str, **headers: str) -> str | int:
        client = Socket(stand.app, target, (), {"host": HOST, **headers})
        await client.say({"type": "websocket.connect"})
        head = await client.message()
        await client.say({"type": "websocket.disconnect", "code": 1000})
        await client.task
        return int(head.get("status", 0)) or str(head["type"])

    one = await ticket()
    assert await handshake(f"/events?ticket={one}") == "websocket.accept"
    assert await handshake(f"/events?ticket={one}") == 401
    for headers in ({"origin": "http://evil.example"}, {"host": "evil.example"}):
        assert await handshake(f"/events?ticket={await ticket()}", **headers) == 403
    two = await ticket()
    assert await handshake(f"/events?ticket={two}&ticket={two}") == 401
    for path in (f"/bodies?ticket={await ticket()}", f"/metrics?ticket={await ticket()}"):
        assert (await stand.get(path)).status_code == 401
    scoped = await ticket("leg")
    assert await handshake(f"/events?ticket={scoped}") == 403
    assert await handshake(f"/events?bodies=leg.00&ticket={await ticket('leg')}") == "websocket.accept"
    late = await ticket()
    stand.app.access.tickets._clock = lambda: 10**9
    assert await handshake(f"/events?ticket={late}") == 401
