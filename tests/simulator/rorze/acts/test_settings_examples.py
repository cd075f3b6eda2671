"""The manual's examples for commands C, D, E, F, P and Q, each against a controller set up for it."""

from typing import Any

import pytest

from protocols.rorze import encoder, flash, input_logic, inputs_outputs, modes, stall_sensor
from protocols.rorze.row import RorzeCommand
from simulator.rorze.actions import codes_acted_out
from simulator.rorze.world import CCW_LIMIT, ORIGIN
from tests.protocols.rorze.examples import exchanges
from tests.simulator.rorze.bench import Bench

MODULES = (inputs_outputs, input_logic, modes, flash, stall_sensor, encoder)
ROWS = [
    row
    for module in MODULES
    for row in vars(module).values()
    if isinstance(row, type) and issubclass(row, RorzeCommand) and row.code in codes_acted_out()
]

DIALOGUE = """
CCD > 000000050 after EAS2 CCS50
CEDE > 2,1 after CESE,2,1
CEDA > after CESE,2,1
CFD8,P > 0025 after CFS8,P:25
CFD8,P > after CFS8,P:25 CFS8,P:
CFD8,E > 0026 after CFS8,E:26
CFD9,C > 0027 after CFS9,C:27
CFD8,O > 5,1,00010 after CFS8,O:5,1,10
CFD8,O > after CFS8,O:5,1,10 CFS8,O:
COD1 > 1 after COS1,1
COD > H003D after COSH003D
CPD8 > 2 after CPS8,2
CPD8 > 0 after CPS8,2 CPS8,0
CRDE > 0
CRD > H0
CSD8 > -000000050,+000000050 after CSS8,-50,50
CSD8 > -999999999,+999999999 after CSS8,-50,50 CSS8
DCD14 > 005 after DCS14,5
DCD3 > 001 after DCS5 DCS1
DID1 > 0 after DIS0,1
DID > H003F after DISH003F
DLD0 > 1 after DLS0,1
DLD > H01 after DLSH01
EAD > 0 after EAS1 EAS0
EDD > 0 after EDS0
EMD > C:H06,M:H00,S:H00,I:H0001 after EMSC:H06,I:H0001
EPD > -000000500,+000000500 after EPS-500,500
EPD > -999999999,+999999999 after EPS-500,500 EPS
ESD > C,I,P after ESSC,I,P
PBD > 00200.00 after PBS200.00
QID > 00100 after QIS100
QRD > 0
QSD > 1 after QSS1
"""


@pytest.mark.parametrize("line", DIALOGUE.split("\n")[1:-1])
def test_what_was_set_is_what_is_got(line: str) -> None:
    bench = Bench()
    exchange, _, before = line.partition(" after ")
    command, _, reply = exchange.partition(" > ")
    bench.sent(*before.split())
    assert bench.send(command.removesuffix(" >")) == reply


def test_the_printed_states_of_inputs_and_sensors() -> None:
    bench = Bench()
    bench.axis.world.inputs = 0x3C
    bench.axis.world.forced |= {ORIGIN: True, CCW_LIMIT: True}
    bench.axis.sense(0.0)
    assert [bench.send(text) for text in ("CID5", "CID", "CLD5", "CLD")] == ["1", "H003C", "0", "H0A"]


@pytest.mark.parametrize("row", ROWS, ids=lambda row: row.code)
def test_every_example_is_carried_out_and_answered_in_its_form(row: type[RorzeCommand[Any]]) -> None:
    for parameters, _ in exchanges(row):
        bench = Bench()
        bench.sent(f"EAS{row.modes[0]}")
        reply = bench.send(row.code + parameters)
        assert not reply.startswith("@")
        row.read(parameters).read_reply(reply)


@pytest.mark.parametrize(
    "text",
    ["CSS8,50,-50", "CSS7", "CID10", "CLD6", "COS16,1", "DLS7,1", "DCS15,1", "EAS3", "EPS5,5", "FESXxxx"],
)
def test_what_is_out_of_range_is_refused(text: str) -> None:
    assert Bench().send(text) == "@4A"


def test_settings_that_shape_a_move_are_refused_while_it_runs() -> None:
    bench = Bench()
    bench.sent("1+MZ")
    refused = ["EAS1", "EDS0", "EPS", "EMS", "ESSC", "FIS", "FPS", "FPD", "QSS1", "QIS100", "PBS2.00"]
    assert [bench.send(text) for text in refused] == ["@50"] * len(refused)


def test_clr_commands_are_for_servo_mode() -> None:
    bench = Bench()
    assert [bench.send(text) for text in ("CCD", "CCS50", "CLS1")] == ["@61"] * 3


def test_a_new_encoder_ratio_converts_what_is_counted_as_before() -> None:
    bench = Bench()
    bench.sent("1+M1000")
    bench.until_end()
    assert bench.send("6ED") == "+000001000"
    bench.sent("PBS2.50")
    assert (bench.send("6ED"), bench.send("6MD")) == ("+000001000", "+000002500")
