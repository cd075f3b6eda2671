"""Event messages: what causes them and what they carry (RC-420 manual 13.11)."""

import pytest

from protocols.rorze.link import StatusChanged
from simulator.rorze.world import EMS, STALL
from tests.simulator.rorze.bench import Bench


@pytest.fixture
def bench() -> Bench:
    return Bench()


def events(bench: Bench) -> list[dict[str, int]]:
    frames = [message.frame for message in bench.axis.take_messages()]
    return [dict(frame.fields) for frame in frames if isinstance(frame, StatusChanged)]


def touch(bench: Bench, inputs: int = 0, ems: bool = False) -> None:
    bench.axis.world.inputs = inputs
    bench.axis.world.forced[EMS] = ems
    bench.axis.sense(bench.now)


def test_nothing_is_said_until_a_cause_is_chosen(bench: Bench) -> None:
    assert bench.send("EMD") == "C:H00,M:H00,S:H00,I:H0000"
    assert bench.send("ESD") == ""
    touch(bench, inputs=0x3FF, ems=True)
    assert events(bench) == []


def test_the_manual_s_mask_reports_ems_and_input_0_at_both_edges(bench: Bench) -> None:
    bench.sent("EMS S:H20,I:H0001", "ESS M,I")
    touch(bench, inputs=0x001)
    touch(bench, inputs=0x003)
    touch(bench, inputs=0x002)
    touch(bench, inputs=0x002, ems=True)
    touch(bench, inputs=0x002)
    assert events(bench) == [{"M": 0, "I": 1}, {"M": 0, "I": 2}, {"M": 0, "I": 2}, {"M": 0, "I": 2}]


def test_status_is_reported_when_it_rises_only(bench: Bench) -> None:
    bench.sent("EMS C:H08", "ESS C")
    assert bench.send("XXX") == "@49"
    assert bench.send("XXX") == "@49"
    bench.sent("9CS")
    assert bench.send("XXX") == "@49"
    assert events(bench) == [{"C": 0x08}, {"C": 0x08}]


def test_a_message_carries_the_values_of_its_moment_in_one_order(bench: Bench) -> None:
    bench.axis.world.forced[STALL] = False
    bench.sent("EMS M:H08", "ESS P,O,I,S,M,C", "COS 3,1", "1+M 20000")
    bench.wait(0.3)
    touch(bench, inputs=0x100, ems=True)
    at = bench.position()
    [event] = events(bench)
    assert event == {"C": 0x04, "M": 0x08, "S": 0x20, "I": 0x100, "O": 0x0008, "P": at}
    assert list(event) == ["C", "M", "S", "I", "O", "P"]
    assert bench.send("ESD") == "P,O,I,S,M,C"
    assert bench.send("ERD") == f"C:H04,M:H08,S:H20,I:H0100,O:H0008,P:{at:+010d}"


def test_a_message_without_contents_still_says_that_something_happened(bench: Bench) -> None:
    bench.sent("EMS I:H0001")
    touch(bench, inputs=0x001)
    assert events(bench) == [{}]


def test_causes_left_out_are_masked_again(bench: Bench) -> None:
    bench.sent("EMS C:H06,I:H0001")
    assert bench.send("EMD") == "C:H06,M:H00,S:H00,I:H0001"
    bench.sent("EMS")
    assert bench.send("EMD") == "C:H00,M:H00,S:H00,I:H0000"
    assert bench.send("EMS I:H0400") == "@4A"


def test_pulses_running_never_cause_a_message(bench: Bench) -> None:
    assert bench.send("EMS C:H01") in ("@4A", "")
    bench.sent("1+M 100")
    bench.until_end()
    assert events(bench) == []
