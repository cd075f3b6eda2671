"""The answer to a request that is not valid: it names the place, the expected value and the given one."""

import pytest

from api.common.faults import MOST_FAULTS
from tests.api.stand import RELATIVE, Stand, on_stand

THEIR_WORDS = ("Input should", "Value error", "Field required", "Extra inputs", "Unable to", "discriminator")


@pytest.mark.parametrize(
    ("path", "content", "field", "said"),
    [
        (
            "moves",
            {"direction": "cw"},
            "kind",
            "is required: 'relative', 'absolute', 'position', 'home', 'continuous'",
        ),
        (
            "moves",
            {"kind": "fly"},
            "kind",
            "must be 'relative', 'absolute', 'position', 'home' or 'continuous'",
        ),
        (
            "moves",
            {"kind": "relativ"},
            "kind",
            "must be 'relative', 'absolute', 'position', 'home' or 'continuous' (did you mean 'relative'?)",
        ),
        (
            "moves",
            RELATIVE | {"speed": "hihg"},
            "speed",
            "must be 'high' or 'low', not 'hihg' (did you mean 'high'?)",
        ),
        ("moves", RELATIVE | {"speeed": "low"}, "speeed", "is not known here (did you mean speed?)"),
        (
            "moves",
            RELATIVE | {"distance": {"valu": 5, "unit": "pulse"}},
            "distance.valu",
            "is not known here (did you mean value?)",
        ),
        ("moves", RELATIVE | {"direction": "up"}, "direction", "must be 'cw' or 'ccw', not 'up'"),
        ("moves", RELATIVE | {"pattern": 30}, "pattern", "must be 29 or less, not 30"),
        (
            "moves",
            RELATIVE | {"distance": {"value": 5.5, "unit": "pulse"}},
            "distance",
            "pulses must be a whole number, not 5.5",
        ),
        ("moves", 500, "", "must be an object, not 500"),
        ("moves", [], "", "must be an object"),
        (
            "commands/move-clockwise",
            {"distance": 5.5},
            "distance",
            "must be a whole number or an object or 'endless', not 5.5",
        ),
        (
            "commands/move-clockwise",
            {"distance": {"positon": 3}},
            "distance.positon",
            "is not known here (did you mean position?)",
        ),
        ("commands/set-start-speed", {"sped": 3}, "sped", "is not known here (did you mean speed?)"),
        ("commands/set-start-speed", {}, "speed", "is required"),
        ("stop", {"mod": "immediate"}, "mod", "is not known here (did you mean mode?)"),
        ("speed", {}, "mode", "is required: 'accelerate', 'decelerate', 'change'"),
    ],
)
def test_a_fault_is_told_with_its_place_and_the_culprit(
    path: str, content: object, field: str, said: str
) -> None:
    @on_stand()
    async def story(stand: Stand) -> None:
        answer = await stand.post(f"/bodies/3F/{path}", content)
        assert answer.status_code == 422
        told = answer.json()
        assert {"field": field, "message": said} in told["errors"], told
        first = told["errors"][0]
        whole = f"{first['field'] or 'The request body'}: {first['message']}; nothing was s"
        assert told["detail"].startswith(whole)
        assert not any(words in answer.text for words in THEIR_WORDS)

    story()


@pytest.mark.parametrize(
    ("content", "said"),
    [
        (
            {"kind": "absolute", "positon": {"value": 5, "unit": "pulse"}},
            "positon: is not known here (did you mean position?)",
        ),
        (
            {"kid": "absolute", "position": {"value": 5, "unit": "pulse"}},
            "kind: is required: 'relative', 'absolute', 'position', 'home', 'continuous'; "
            "'kid' is not known here",
        ),
    ],
)
def test_a_name_that_was_mistyped_is_told_rather_than_the_one_that_is_missing(
    content: object, said: str
) -> None:
    @on_stand()
    async def story(stand: Stand) -> None:
        answer = await stand.post("/bodies/3F/moves", content)
        assert answer.json()["detail"] == f"{said}; nothing was sent."

    story()


@on_stand()
async def test_what_is_given_is_repeated_shortly_and_printably(stand: Stand) -> None:
    answer = await stand.post("/bodies/3F/moves", RELATIVE | {"direction": "\x1b[2J" + "x" * 5000})
    assert len(answer.text) < 1000
    assert answer.json()["detail"].isprintable()


@on_stand()
async def test_a_thousand_faults_make_no_long_answer(stand: Stand) -> None:
    for content in (
        RELATIVE | {f"a{number}": 1 for number in range(90)},
        RELATIVE | {"x" * 60_000: 1, "\x1b[2J": 1},
    ):
        answer = await stand.post("/bodies/3F/moves", content)
        assert answer.status_code == 422
        assert len(answer.content) < 5000
        assert len(answer.json()["errors"]) <= MOST_FAULTS
        assert all(error["field"].isprintable() for error in answer.json()["errors"])


@pytest.mark.parametrize("content", [b"{", b"{'a': 1}", b"[1,]", b"\xff\xfe", b"nul"])
def test_what_is_no_json_is_told_in_our_words(content: bytes) -> None:
    @on_stand()
    async def story(stand: Stand) -> None:
        headers = {"content-type": "application/json"}
        answer = await stand.client.post("/bodies/3F/moves", content=content, headers=headers)
        assert answer.status_code == 400
        detail = answer.json()["detail"]
        assert "it cannot be read at line 1, column" in detail or "it is not UTF-8 text" in detail
        assert not any(words in detail for words in ("Expecting", "codec", "char "))

    story()


@pytest.mark.parametrize(
    ("path", "said"),
    [
        ("/bodies/3F/moves?limit=x", "limit: must be a whole number, not 'x'"),
        ("/bodies/3F/moves?limit=0", "limit: must be 1 or more, not '0'"),
        ("/bodies/3F/moves?limt=1", "There is no query parameter 'limt' here (did you mean limit?)"),
        ("/commands?family=other", "family: must be 'rorze' or 'fics', not 'other'"),
    ],
)
def test_a_fault_of_the_query_is_told_too(path: str, said: str) -> None:
    @on_stand()
    async def story(stand: Stand) -> None:
        answer = await stand.get(path)
        assert answer.status_code == 422
        assert answer.json()["detail"] == f"{said}; nothing was sent."

    story()
