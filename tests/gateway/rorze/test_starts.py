"""Before a motion a body is asked for what is not known, in one order, and for nothing twice."""

from collections.abc import Sequence
from contextlib import suppress
from typing import Any, Final

import pytest
from hypothesis import given
from hypothesis import strategies as st

from gateway.core.errors import BodyBusy, NotSent, PowerCycled
from gateway.core.preparation import Asked
from gateway.rorze.knowledge import PULSES_RUNNING, BodyFacts, MotorState, Prepared
from gateway.rorze.power import BodyPower, PowerMark
from gateway.rorze.starts import NEEDS, SharedWay, Start, StartQuestion, needs_of, spoils
from protocols.rorze.moves import MoveClockwise, MoveTo
from protocols.rorze.notation import PositionReference
from protocols.rorze.origin import Home
from protocols.rorze.row import RorzeCommand

ENTRY: Final = PositionReference(position=5)
COMMANDS: Final[Sequence[RorzeCommand[Any]]] = (
    MoveTo(position=500),
    MoveTo(position=ENTRY),
    MoveTo(position=ENTRY, pattern=12),
    MoveClockwise(distance=300),
    MoveClockwise(distance=ENTRY),
    MoveClockwise(distance="endless"),
    Home(),
)
STANDS: Final = {StartQuestion.POWER: True}
AT_REST: Final = MotorState(0, 100)
RUNS: Final = MotorState(PULSES_RUNNING, 100)


def start_of(command: RorzeCommand[Any], mark: str | None = "GW-0", **known: Any) -> Start:
    power = known.pop("power", None) or BodyPower(mark=PowerMark(comment=1, text=mark))
    tolerance = known.pop("tolerance", 0)
    return Start(
        "line1.3F", command, BodyFacts(), Prepared(), power, spoils(power, command), tolerance, **known
    )


def asked(
    start: Start, answers: dict[StartQuestion, Any], questions: list[StartQuestion] | None = None
) -> list[StartQuestion]:
    """Run the needs as the runner does, with these answers; give the questions."""
    questions = [] if questions is None else questions
    for need in needs_of(start):
        heard: list[Asked[StartQuestion, None]] = []
        while (question := need(heard)) is not None:
            questions.append(question)
            assert len(questions) <= len(StartQuestion)
            _take(start, question, answers.get(question))
            heard.append(Asked(question, None))
    return questions


def _take(start: Start, question: StartQuestion, answer: Any) -> None:
    """Learn as `BodyRun` does."""
    if question is StartQuestion.MARK:
        start.rest = None
        start.power.mark.text = answer
    elif question is StartQuestion.REST:
        start.rest = answer or AT_REST
    elif question is StartQuestion.TARGET:
        start.entry = answer or 7_000
    elif question is StartQuestion.MODE:
        start.mode = answer or "encoder"
    elif question is StartQuestion.SPEEDS and answer:
        start.told.pattern_sets = {12: answer}
    elif question is StartQuestion.POWER:
        start.stands = answer


@pytest.mark.parametrize(
    ("command", "mark", "answers", "questions"),
    [
        (MoveTo(position=500), "GW-0", STANDS, ["REST", "POWER"]),
        (MoveTo(position=500), None, {}, ["MARK", "REST", "POWER", "NEW_MARK"]),
        (MoveTo(position=ENTRY), "GW-0", {StartQuestion.POWER: True}, ["REST", "TARGET", "POWER"]),
        (
            MoveTo(position=ENTRY, pattern=12),
            "GW-0",
            {StartQuestion.POWER: True},
            ["REST", "TARGET", "SPEEDS", "POWER"],
        ),
        (MoveClockwise(distance=300), "GW-0", {}, ["REST"]),
        (MoveClockwise(distance="endless"), None, {}, ["REST"]),
    ],
)
def test_what_is_missing_is_asked_for_in_order(
    command: RorzeCommand[Any], mark: str | None, answers: dict[StartQuestion, Any], questions: list[str]
) -> None:
    assert [question.name for question in asked(start_of(command, mark), answers)] == questions


def test_positions_that_an_encoder_counts_are_asked_for_only_where_that_matters() -> None:
    command = MoveClockwise(distance=300)
    assert StartQuestion.MODE not in asked(start_of(command), {})
    start = start_of(command, tolerance=4)
    assert StartQuestion.MODE in asked(start, {})
    assert start.way == (400, 4)
    pulses = start_of(command, tolerance=4, mode="pulse")
    assert StartQuestion.MODE not in asked(pulses, {})
    assert pulses.way == (400, 0)
    assert StartQuestion.MODE not in asked(start_of(MoveClockwise(distance="endless"), tolerance=4), {})


def test_a_motor_that_runs_forbids_the_motion_once_all_is_known() -> None:
    with pytest.raises(BodyBusy, match="by no move of this gateway"):
        asked(start_of(MoveClockwise(distance=300)), {StartQuestion.REST: RUNS})
    with pytest.raises(BodyBusy, match="by its user program"):
        asked(start_of(MoveClockwise(distance=300), in_program=True), {StartQuestion.REST: RUNS})


def test_a_loss_of_power_forbids_a_motion_to_a_place() -> None:
    power = BodyPower(cycled=True)
    with pytest.raises(PowerCycled):
        asked(start_of(MoveTo(position=500), power=power), {})
    asked(start_of(MoveClockwise(distance=300), power=power), {})


def test_a_planned_move_begins_where_its_plan_does_and_has_its_way() -> None:
    start = start_of(MoveClockwise(distance=300), stretch=SharedWay(100, 900, 3))
    assert asked(start, {}) == [StartQuestion.REST]
    assert start.way == (900, 3)
    with pytest.raises(NotSent, match="stands at 100, and the move was planned from 99"):
        asked(start_of(MoveClockwise(distance=300), stretch=SharedWay(99, 900, 3)), {})


@given(st.data())
def test_from_any_knowledge_the_answers_lead_to_a_motion_or_its_refusal(data: st.DataObject) -> None:
    draw = data.draw
    command = draw(st.sampled_from(COMMANDS))
    states = st.sampled_from([AT_REST, RUNS])
    known: dict[str, Any] = {
        "rest": draw(st.none() | states),
        "entry": draw(st.none() | st.integers(0, 9_000)),
        "mode": draw(st.sampled_from([None, "pulse", "encoder"])),
        "tolerance": draw(st.sampled_from([0, 4])),
        "stands": draw(st.sampled_from([None, True, False])),
        "stretch": draw(st.none() | st.just(SharedWay(100, 900, 3))),
    }
    mark = draw(st.sampled_from([None, "GW-0"]))
    power = BodyPower(mark=PowerMark(comment=1, text=mark), cycled=draw(st.booleans()))
    start = start_of(command, power=power, **known)
    answers = {
        StartQuestion.MARK: draw(st.sampled_from([None, "GW-1"])),
        StartQuestion.REST: draw(states),
        StartQuestion.POWER: draw(st.sampled_from([None, True, False])),
        StartQuestion.SPEEDS: draw(st.sampled_from([None, "told"])),
    }
    questions: list[StartQuestion] = []
    with suppress(PowerCycled, BodyBusy, NotSent):
        asked(start, answers, questions)
    assert questions == sorted(set(questions), key=list(NEEDS).index), "each once, in one order"
    if known["rest"] is not None and StartQuestion.MARK not in questions:
        assert StartQuestion.REST not in questions
    for fact, question in (("entry", "TARGET"), ("mode", "MODE"), ("stands", "POWER")):
        if known[fact] is not None:
            assert StartQuestion[question] not in questions
    if mark is not None:
        assert StartQuestion.MARK not in questions
