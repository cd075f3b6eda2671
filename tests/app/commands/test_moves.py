"""The commands `send` and `move`: the requests they send, and the exit codes that a script gets."""

from typing import Any

import pytest

from app import exits
from tests.app.fake_gateway import FakeGateway, always, move, plant, stopped


@pytest.mark.parametrize(
    ("answer", "code"),
    [
        (move("succeeded"), 0),
        (move("stopped", "yes"), 1),
        (move("failed", "yes"), 1),
        (move("failed", "no"), 1),
        (move("failed", "unknown"), 4),
        (move("rejected", "no"), 1),
        (move("cancelled", "no"), 1),
        (move("lost", "yes"), 1),
        (move("lost", "unknown"), 4),
        (move("unknown", "unknown"), 4),
        (move("unknown", "yes"), 4),
        (move("moving"), 5),
        (move("sent"), 5),
    ],
)
def test_the_end_of_a_move_that_was_waited_for(
    answer: dict[str, Any], code: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    for words in (("send", "3F", "1+M500"), ("move", "3F", "relative", "500")):
        assert always(answer).run(monkeypatch, *words, "--wait", "10").exit_code == code


def test_a_move_that_nobody_waits_for_is_done_when_it_is_under_way(monkeypatch: pytest.MonkeyPatch) -> None:
    said = always(move("moving"), 202).run(monkeypatch, "send", "3F", "1+M500")
    assert (said.exit_code, '"status": "moving"' in said.stdout) == (0, True)


def test_a_long_wait_is_made_of_short_ones_until_the_move_is_over(monkeypatch: pytest.MonkeyPatch) -> None:
    gateway = FakeGateway(
        {
            "/bodies/3F/moves": [(202, move("moving"))],
            "/bodies/a.3F/moves/m1": [(200, move("moving")), (200, move("succeeded"))],
        }
    )
    said = gateway.run(monkeypatch, "move", "3F", "home", "--wait", "100")
    assert said.exit_code == 0
    assert gateway.paths == ["/bodies/3F/moves", "/bodies/a.3F/moves/m1", "/bodies/a.3F/moves/m1"]
    assert [request.headers["Prefer"] for request in gateway.asked] == ["wait=2"] * 3


def test_a_gateway_that_goes_during_the_wait_leaves_the_move_unknown(monkeypatch: pytest.MonkeyPatch) -> None:
    unit_move = move("moving", body="r1/units/1")
    gateway = FakeGateway(
        {**plant(), "/robots/r1/units/1/moves": [(202, unit_move)]}, (503, {"detail": "Down."})
    )
    said = gateway.run(monkeypatch, "move", "r1/units/1", "home", "--wait", "10")
    assert said.exit_code == 4
    assert "was started, and its end was not seen: Down." in said.stderr
    assert gateway.paths[-1] == "/robots/r1/units/1/moves/m1"


@pytest.mark.parametrize("begun", [KeyboardInterrupt(), move("moving")])
def test_who_breaks_a_wait_off_is_told_that_the_move_goes_on(
    begun: object, monkeypatch: pytest.MonkeyPatch
) -> None:
    gateway = FakeGateway(
        {"/bodies/3F/moves": [(202, begun)], "/bodies/a.3F/moves/m1": [(200, KeyboardInterrupt())]}
    )
    said = gateway.run(monkeypatch, "move", "3F", "home", "--wait", "100")
    assert (said.exit_code, said.stderr) == (
        4,
        "Only the wait was interrupted: the move goes on if it was begun. `motion-gateway stop` stops it by "
        "software.\n",
    )


def test_who_breaks_a_setting_off_is_told_that_it_may_have_been_made(monkeypatch: pytest.MonkeyPatch) -> None:
    said = always(KeyboardInterrupt()).run(monkeypatch, "send", "3F", "0SS25")
    assert (said.exit_code, "the command goes on if it was begun" in said.stderr) == (4, True)


def test_the_moves_of_a_group_are_waited_for_together(monkeypatch: pytest.MonkeyPatch) -> None:
    under_way = [{**move("moving"), "id": name} for name in ("m1", "m2", "m3")]
    gateway = FakeGateway(
        {
            "/groups/80/moves": [(202, {"group_id": "a.80", "moves": [move("succeeded"), *under_way[1:]]})],
            "/bodies/a.3F/moves/m2": [(200, under_way[1]), (200, {**move("succeeded"), "id": "m2"})],
            "/bodies/a.3F/moves/m3": [(200, {**move("succeeded"), "id": "m3"})],
        }
    )
    said = gateway.run(monkeypatch, "move", "80", "home", "--wait", "5")
    assert said.exit_code == 0, said.output
    waits = [(request.path[-2:], request.headers.get("Prefer")) for request in gateway.asked]
    assert waits == [("es", "wait=2"), ("m2", "wait=2"), ("m3", None), ("m2", "wait=1")]


def test_the_moves_of_a_group_are_as_good_as_the_worst(monkeypatch: pytest.MonkeyPatch) -> None:
    moves = {
        "group_id": "a.80",
        "moves": [move("succeeded"), move("unknown", "unknown"), move("failed", "yes")],
    }
    gateway = always(moves)
    said = gateway.run(monkeypatch, "move", "80", "absolute", "0", "--wait", "2")
    assert said.exit_code == 4
    assert gateway.paths == ["/groups/80/moves"]


@pytest.mark.parametrize(
    ("answer", "code"),
    [
        (stopped("confirmed"), 0),
        (stopped("sent"), 4),
        (stopped("not_sent"), 3),
    ],
)
def test_a_stop_that_is_sent_is_done_at_standstill(
    answer: dict[str, Any], code: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert always(answer).run(monkeypatch, "send", "3F", "5IS").exit_code == code


def test_a_reply_may_have_a_status_of_its_own(monkeypatch: pytest.MonkeyPatch) -> None:
    assert always({"status": 1}).run(monkeypatch, "send", "3F", "URD", "--wait", "10").exit_code == 0


@pytest.mark.parametrize(
    ("written", "path", "parameters"),
    [
        ("6pd", "get-position", {}),
        ("1+ma[12],500", "move-clockwise", {"distance": 500, "pattern": 12}),
        (" 1+M A[12], 500 ", "move-clockwise", {"distance": 500, "pattern": 12}),
        ("9vs7,Left arm", "set-user-comment", {"comment_number": 7, "text": "Left arm"}),
    ],
)
def test_case_and_blanks_matter_only_in_texts(
    written: str, path: str, parameters: dict[str, Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    gateway = always(move("succeeded"))
    said = gateway.run(monkeypatch, "send", "3F", written)
    assert said.exit_code == 0, said.stderr
    assert gateway.posted == [(f"/bodies/3F/commands/{path}", parameters)]


@pytest.mark.parametrize(
    ("address", "written", "path", "parameters"),
    [
        ("r1", "VER", "/robots/r1/commands/get-system-version", {}),
        ("r1/units/2", "ver", "/robots/r1/commands/get-system-version", {}),
        ("R1/units/2", "APS", "/robots/r1/units/2/commands/get-user-position", {}),
        ("r1/1", "aps", "/robots/r1/units/1/commands/get-user-position", {}),
        ("cell", "VAR V7", "/robots/r1/commands/get-variable", {"number": 7}),
        ("arm", "6PD", "/bodies/a.3F/commands/get-position", {}),
        ("both arms", "6PD", "/groups/a.80/commands/get-position", {}),
    ],
)
def test_commands_for_robots_and_for_names(
    address: str, written: str, path: str, parameters: dict[str, Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    gateway = FakeGateway({**plant(r1="cell", b3F="arm", g80="both arms"), path: [(200, {})]})
    said = gateway.run(monkeypatch, "send", address, written)
    assert said.exit_code == 0, said.stderr
    assert gateway.posted == [(path, parameters)]


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (("3F", ""), "no command ''"),
        (("3F", "6P"), "no command '6P'"),
        (("3F", "zzz"), "no command 'ZZZ' of RC-420 bodies"),
        (("3F", "1+Mfast"), "1+M"),
        (("3F", "1+M0"), "1+M"),
        (("3F", "6PD1"), "6PD"),
        (("r1", "APS"), "several units: say r1/units/1, r1/units/2"),
        (("r1/units/1", "VAR x"), "VAR"),
        (("r1/units/1", "JOG X+"), "heartbeats"),
        (("arm", "6PD"), "name of a.3F and a.02: say the address"),
        (("nobody", "6PD"), "nothing called 'nobody'"),
        (("arm/units/1", "APS"), "nothing called 'arm/units/1'"),
    ],
)
def test_what_is_no_command_is_not_sent(
    words: tuple[str, str], sentence: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    gateway = FakeGateway(plant(b3F="arm", b02="arm"))
    said = gateway.run(monkeypatch, "send", *words)
    assert (said.exit_code, said.stdout, gateway.posted) == (2, "", []), said.output
    assert sentence in said.stderr
    assert "Nothing was sent" in said.stderr


@pytest.mark.parametrize(
    ("words", "path", "content"),
    [
        (
            ("3F", "relative", "500"),
            "/bodies/3F/moves",
            {"kind": "relative", "direction": "cw", "distance": {"value": 500, "unit": "pulse"}},
        ),
        (
            ("a.3f", "relative", "-12.5", "--unit", "mm"),
            "/bodies/a.3F/moves",
            {"kind": "relative", "direction": "ccw", "distance": {"value": 12.5, "unit": "mm"}},
        ),
        (
            ("arm", "absolute", "-7"),
            "/bodies/a.3F/moves",
            {"kind": "absolute", "position": {"value": -7, "unit": "pulse"}},
        ),
        (("80", "home"), "/groups/80/moves", {"kind": "home"}),
        (("r1/units/1", "home"), "/robots/r1/units/1/moves", {"kind": "home"}),
        (("3F", "position", "5"), "/bodies/3F/moves", {"kind": "position", "position": 5}),
        (("r1/units/1", "position", "5"), "/robots/r1/units/1/moves", {"kind": "position", "position": 5}),
        (
            ("r1/units/1", "relative", "x=10", "@=-5.5"),
            "/robots/r1/units/1/moves",
            {
                "kind": "relative",
                "axes": {"X": {"value": 10, "unit": "mm"}, "@": {"value": -5.5, "unit": "degree"}},
            },
        ),
        (
            ("r1/units/1", "absolute", "X=3", "--unit", "pulse"),
            "/robots/r1/units/1/moves",
            {"kind": "absolute", "axes": {"X": {"value": 3, "unit": "pulse"}}},
        ),
        (
            ("Wafer", "line", "X=0", "y=150.5", "--pattern", "3"),
            "/scaras/wafer/moves",
            {
                "kind": "line",
                "x": {"value": 0, "unit": "mm"},
                "y": {"value": 150.5, "unit": "mm"},
                "pattern": 3,
            },
        ),
        (
            ("hand", "rotate", "R=150000", "A=90", "--unit", "um"),
            "/scaras/wafer/moves",
            {
                "kind": "rotate",
                "radius": {"value": 150_000, "unit": "um"},
                "angle": {"value": 90, "unit": "deg"},
            },
        ),
        (
            ("wafer", "extend", "10"),
            "/scaras/wafer/moves",
            {"kind": "extend", "distance": {"value": 10, "unit": "mm"}},
        ),
        (("wafer", "path", "3"), "/scaras/wafer/moves", {"kind": "path", "path": 3}),
        (
            ("wafer", "path", "255,300,120", "255,450"),
            "/scaras/wafer/moves",
            {
                "kind": "path",
                "points": [
                    {
                        "x": {"value": 255, "unit": "mm"},
                        "y": {"value": 300, "unit": "mm"},
                        "radius": {"value": 120, "unit": "mm"},
                    },
                    {"x": {"value": 255, "unit": "mm"}, "y": {"value": 450, "unit": "mm"}},
                ],
            },
        ),
    ],
)
def test_moves_in_few_words(
    words: tuple[str, ...], path: str, content: object, monkeypatch: pytest.MonkeyPatch
) -> None:
    gateway = FakeGateway({**plant(b3F="arm", wafer="hand"), path: [(202, move("moving"))]})
    said = gateway.run(monkeypatch, "move", *words)
    assert said.exit_code == 0, said.output
    assert gateway.posted == [(path, content)]


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (("3F", "relative"), "takes one value"),
        (("3F", "relative", "1", "2"), "takes one value"),
        (("3F", "relative", "fast"), "'fast' is no number"),
        (("3F", "relative", "1e3"), "'1e3' is no number"),
        (("3F", "relative", "nan"), "'nan' is no number"),
        (("3F", "relative", "5", "--wiat=3"), "takes one value"),
        (("3F", "home", "5"), "`home` takes no value"),
        (("3F", "line", "X=1"), "Only SCARA robots have moves `line`"),
        (("r1/units/1", "extend", "1"), "Only SCARA robots have moves `extend`"),
        (("wafer", "home"), "A SCARA robot has no move `home`"),
        (("wafer", "extend"), "`extend` takes one number"),
        (("wafer", "line", "X=1", "X=2"), "'X=2' is none of X and Y"),
        (("wafer", "rotate", "X=1"), "'X=1' is none of R and A"),
        (("wafer", "line", "X=far"), "'far' is no number"),
        (("3F", "position"), "`position` takes one number"),
        (("r1/units/1", "home", "5"), "`home` takes no value"),
        (("r1/units/1", "relative"), "takes an axis"),
        (("r1/units/1", "relative", "5"), "'5' is no axis"),
        (("r1/units/1", "relative", "X=5", "x=6"), "each axis once"),
        (("r1", "relative", "X=5"), "several units"),
    ],
)
def test_what_is_no_move_is_not_sent(
    words: tuple[str, ...], sentence: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    gateway = FakeGateway(plant())
    said = gateway.run(monkeypatch, "move", *words)
    assert (said.exit_code, said.stdout, gateway.posted) == (exits.USAGE, "", []), said.output
    assert sentence in said.stderr
