"""The calls of a robot's first move: each command is written out once, and few calls go to another file."""

import pytest

from benchmarks.trace_calls import CallTrace, first_move, first_move_of_body
from tests.api.robots.cell import Cell, in_cell
from tests.api.stand import Stand, on_stand

ABOVE_THE_LINE = 478
IN_ALL = 935
FILES = 77
OF_A_BODY = 343
OF_A_BODY_ABOVE = 226
FILES_OF_A_BODY = 72


@pytest.mark.parametrize("mode", [2, 3])
def test_each_command_of_a_first_move_is_written_out_once(mode: int) -> None:
    @in_cell(mode=mode)
    async def story(cell: Cell) -> None:
        trace = await first_move(cell)
        assert trace.written, "nothing was traced"
        assert set(trace.written.values()) == {1}

    story()


def test_few_calls_of_a_first_move_go_to_another_file() -> None:
    traces: list[CallTrace] = []

    @in_cell()
    async def story(cell: Cell) -> None:
        traces.append(await first_move(cell))

    story()  # what a process learns once is learned, whichever test came before
    story()
    assert 100 < traces[-1].passes_above_the_line().total() < ABOVE_THE_LINE
    assert traces[-1].passes().total() < IN_ALL
    assert len(set(traces[-1].files)) <= FILES


def test_few_calls_of_a_bodys_first_move_go_to_another_file() -> None:
    traces: list[CallTrace] = []

    @on_stand()
    async def story(stand: Stand) -> None:
        traces.append(await first_move_of_body(stand))

    story()
    story()
    assert 50 < traces[-1].passes_above_the_line().total() < OF_A_BODY_ABOVE
    assert traces[-1].passes().total() < OF_A_BODY
    assert len(set(traces[-1].files)) < FILES_OF_A_BODY


@in_cell()
async def test_what_the_simulator_writes_out_is_not_counted(cell: Cell) -> None:
    with CallTrace() as trace:
        cell.rig.cable.write(b"VER\r")
    assert not trace.written
