"""A body's settings as text and back: nothing is lost, and nothing else is taken from a file."""

from collections import defaultdict
from collections.abc import Sequence
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from gateway.core.errors import InvalidText, Misplaced
from gateway.rorze.backup import Contents, commands, differences, parse, written
from gateway.rorze.backup_places import PLACES_OF, Command, Section, normal, place_of
from gateway.rorze.bodies import Body, Configured
from gateway.rorze.units import Scale
from protocols.rorze.commands import COMMANDS as CODES
from protocols.rorze.inputs_outputs import SetErrorOutput, SetInterruptAction, SetInterruptMode
from protocols.rorze.interpolation import SetPulsesPerTurn
from protocols.rorze.notation import PositionReference
from protocols.rorze.patterns import SetPattern, SetSpeedChange
from protocols.rorze.position_table import SetPositionEntry
from protocols.rorze.programs import SetProgramMemory
from protocols.rorze.speeds import SetMaximumSpeed
from protocols.rorze.status import SetUserComment

SLOTS, PULSES = st.integers(0, 29), st.integers(-999_999_999, 999_999_999).filter(bool)
COMMENTS = st.from_regex(r"(?:[!-%'-=?A-~](?:[ -%'-=?-~]{0,38}[!-%'-=?-~])?)?", fullmatch=True)
COMMANDS: dict[Section, st.SearchStrategy[Command]] = {
    "settings": st.builds(SetUserComment, comment_number=st.integers(1, 7), text=COMMENTS)
    | st.builds(SetErrorOutput, cause=st.just("ems"), output=st.integers(0, 15), state=st.integers(0, 1))
    | st.builds(SetInterruptMode, port=st.integers(8, 9), edge=st.sampled_from(("off", "falling")))
    | st.builds(
        SetPulsesPerTurn,
        axis=SLOTS.map(lambda it: it % 10),
        pulses=st.integers(100, 10**8).map(lambda it: it / 100),
    )
    | st.just(SetInterruptAction(port=8, recorded="position")),
    "speed-sets": st.builds(SetMaximumSpeed, speed_set=SLOTS, speed=st.integers(1, 1_000_000)),
    "patterns": st.builds(SetPattern, pattern=SLOTS, acceleration=SLOTS, deceleration=SLOTS)
    | st.builds(
        SetSpeedChange,
        pattern=SLOTS,
        point=st.integers(0, 15),
        begin=st.integers(0, 9999),
        speed=st.integers(1, 9999),
    ),
    "positions": st.builds(
        lambda number, pulses: SetPositionEntry(entry=PositionReference(position=number), pulses=pulses),
        st.integers(0, 2047),
        PULSES,
    ),
    "memories": st.builds(
        lambda place, value: SetProgramMemory(memory=f"D{place}", value=value),
        st.integers(0, 199),
        st.integers(1, 999_999_999),
    )
    | st.builds(lambda bits: SetProgramMemory(memory="D7", bits=bits), st.integers(10**9, 2**32 - 1)),
}


def contents(found: dict[Section, list[Command]]) -> Contents:
    places: dict[Section, dict[str, Command]] = {}
    for name, kept in found.items():
        by_key = {place.key: normal(it) for it in kept if (place := place_of(it))}
        places[name] = {key: by_key[key] for key in PLACES_OF[name] if key in by_key}
    return Contents(places, ("*A", "SETOD0", "SDCa;b", "END"))


CONTENTS = st.fixed_dictionaries(
    {}, optional={name: st.lists(it, max_size=6) for name, it in COMMANDS.items()}
).map(contents)


def body(scale: Scale | None = None) -> Body:
    return Body(None, 0x3F, Configured(scale=scale))  # type: ignore[arg-type]  # nothing is asked


@given(CONTENTS)
def test_what_is_written_is_read_again(kept: Contents) -> None:
    found = parse(written(body(), kept))[0x3F]
    assert found.places == kept.places
    assert found.instructions == kept.instructions
    assert written(body(), found) == written(body(), kept)
    assert differences("3F", found, kept) == []
    assert commands(found, kept) == []


@given(CONTENTS, CONTENTS)
def test_the_commands_take_away_every_difference_that_can_be(wanted: Contents, held: Contents) -> None:
    for name in wanted.places:
        held.places.setdefault(name, {})
    state = defaultdict[str, dict[str, Any]](dict, {key: dict(it) for key, it in held.places.items()})
    for command in commands(wanted, held):
        _obey(state, command)
    left = differences("3F", wanted, Contents(dict(state), held.program))  # type: ignore[arg-type]
    assert not [it for it in left if it.restorable]


def _obey(state: dict[str, dict[str, Any]], command: Command) -> None:
    """Do what a controller does."""
    if isinstance(command, SetSpeedChange) and command.point is None:
        kept = state["patterns"]
        for key in [it for it in kept if it.startswith(f"SEDA[{command.pattern}],")]:
            del kept[key]
        return
    place = place_of(command)
    assert place
    [section] = [name for name, places in PLACES_OF.items() if place.key in places]
    if isinstance(command, SetInterruptMode):
        for key in [it for it in state[section] if it.startswith(f"CFD{command.port},")]:
            del state[section][key]
    state[section][place.key] = command
    if command == place.emptied:
        del state[section][place.key]


HEADINGS = st.sampled_from(
    ["[body 3F]", "[settings]", "[speed-sets]", "[patterns]", "[memories]", "[program]"]
)
LINES = st.one_of(
    HEADINGS,
    st.text(max_size=30),
    st.builds(
        str.__add__, st.sampled_from(sorted(CODES)), st.text("0123456789SAPFDH[],:;.+- E", max_size=12)
    ),
)


@given(st.lists(LINES, max_size=8).map(lambda lines: "\n".join(["[body 3F]", "[settings]", *lines])))
def test_any_text_is_a_backup_or_is_refused_by_its_lines(text: str) -> None:
    found = read_or_faults(text)
    if isinstance(found, Contents):
        assert parse(written(body(), found))[0x3F].places == found.places
    else:
        assert all(1 <= fault.line <= len(text.splitlines()) for fault in found)


def read_or_faults(text: str) -> Contents | Sequence[Misplaced]:
    try:
        [found] = parse(text).values()
    except InvalidText as refusal:
        return refusal.faults
    return found


def test_positions_are_told_in_the_unit_of_the_body() -> None:
    kept = contents({"positions": [SetPositionEntry(entry=PositionReference(position=7), pulses=1250)]})
    assert "3PSP[7],1250                  ; 12.5 mm\n" in written(
        body(Scale(unit="mm", pulses_per_unit=100.0)), kept
    )


@pytest.mark.parametrize(
    ("text", "places"),
    [
        ("", [(1, "There is no heading [body ...].")]),
        ("0BS2", [(1, "A heading such as [settings] has to come first.")]),
        ("[settings]", [(1, "A heading such as [body ...] has to come first.")]),
        ("[body 3F]\n[settings]\n[body 3F]\n[settings]", [(3, "[body 3F] comes twice.")]),
        ("[body left]\n[settings]", [(1, "'left' is no body number.")]),
        ("[body 3F]", [(1, "[body 3F] has no sections.")]),
        ("[body 3F]\n[scale]\n100 pulses\n0 pulses/mm", [(3, "has one line"), (4, "has one line")]),
        ("[body 3F]\n[speeds]", [(2, "There is no section [speeds]; there are settings")]),
        ("[body 3F]\n[settings]\n0BS9\n0SS10\n0SS11", [(3, "0BS"), (5, "the same as a line before it")]),
        ("[body 3F]\n[settings]\n1+M500\nFIS\nCOS3,1\n3PSP[1],5", [(n, "sets nothing") for n in range(3, 7)]),
        ("[body 3F]\n[positions]\n3PSP[+],5\n3PSP[1]", [(3, "sets nothing"), (4, "3PS")]),
        ("[body 3F]\n[program]\n; *A\n JMP *NO\n", [(4, "There is no label *NO.")]),
    ],
)
def test_a_text_with_faults_is_refused_with_their_lines(text: str, places: list[tuple[int, str]]) -> None:
    with pytest.raises(InvalidText) as refusal:
        parse(text)
    told = [(fault.line, fault.reason) for fault in refusal.value.faults]
    assert [line for line, _ in told] == [line for line, _ in places]
    assert all(reason in said for (_, said), (_, reason) in zip(told, places, strict=True))
