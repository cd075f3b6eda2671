"""A robot's settings as text: any text is a backup, or is refused by its lines."""

from collections.abc import Sequence

from hypothesis import given, settings
from hypothesis import strategies as st

from gateway.core.errors import InvalidText, Misplaced
from gateway.fics import backup
from gateway.fics.robot import Robot
from tests.fics_plants import fics_rig
from tests.virtual_time import run_virtual

WORDS = st.sampled_from(
    ["V01", "V99", "speed_percent", "maximum_speed", "homing_type", "smooth_acceleration", "7"]
)
VALUES = st.sampled_from(["X=1", "Y=-2.5", "Z=1e5", "A=3", "on", "12.5", "nan", "X=", "=", ";"])
LINES = st.one_of(
    st.sampled_from(["[variables]", "[unit 1 settings]", "[unit 1 positions]", "[robot r1]"]),
    st.text(max_size=20),
    st.builds(lambda word, values: " ".join([word, *values]), WORDS, st.lists(VALUES, max_size=3)),
)


@settings(max_examples=20)
@given(st.lists(st.lists(LINES, max_size=5), max_size=20))
def test_any_text_is_a_backup_or_is_refused_by_its_lines(texts: list[list[str]]) -> None:
    async def story() -> None:
        async with fics_rig() as it:
            for lines in texts:
                text = "\n".join(["[robot r1]", "[variables]", *lines])
                assert all(1 <= fault.line <= len(text.splitlines()) for fault in faults(it.robot, text))

    run_virtual(story())


def faults(robot: Robot, text: str) -> Sequence[Misplaced]:
    try:
        backup.parse(robot, text)
    except InvalidText as refusal:
        return refusal.faults
    return ()
