"""The program a body holds: read to its very end, whatever stands there."""

from gateway.rorze import stored_program
from protocols.rorze.programs import STEPS
from tests.plants import in_virtual_time, rig


@in_virtual_time
async def test_an_empty_body_has_no_program() -> None:
    async with rig(bodies=(0x3F,), groups={}) as it:
        stored = await stored_program.read(it.body())
        assert (stored.instructions, stored.steps, stored.source) == ((), 0, "")
        assert await stored_program.instruction_at(it.body(), 0) is None


@in_virtual_time
async def test_the_last_address_of_a_full_program_is_read_too() -> None:
    async with rig(bodies=(0x3F,), groups={}) as it:
        for length in (STEPS - 1, STEPS):
            it.axis().program = ("RET",) * (length - 1) + ("END",)
            stored = await stored_program.read(it.body())
            assert (len(stored.instructions), stored.steps) == (length, length)
            assert stored.instructions[-1] == "END"


def test_what_nobody_knows_is_told_as_it_is() -> None:
    stored = stored_program.StoredProgram(("*A", "XYZ,1", "WAT5"), 8, running=False)
    assert (stored.source, stored.labels) == ("*A\nXYZ,1\nWAT 5\n", {"A": 0})
