"""The user programs of the manual, stored and run over the line (RC-420 manual 14, 15.2, 16)."""

import pytest

from protocols.rorze.user_program.assembler import Assembled, assemble
from simulator.rorze.world import CW_LIMIT, STALL, Slits, Span
from tests.contract.hosts import BODY, ClockHost

pytestmark = pytest.mark.anyio

A_WHILE_S = 0.1


class Programmer(ClockHost):
    """A host that stores programs and looks at what they do."""

    async def store(self, source: str) -> Assembled:
        """Put a program text into the controller, in place of what is there."""
        program = assemble(source)
        assert isinstance(program, Assembled), program
        await self.command("UCS", *(f"UWS{text}" for text in program.texts()))
        return program

    async def run(self, source: str, seconds: float = A_WHILE_S) -> None:
        """Store a program, start it, and let time go by."""
        await self.store(source)
        await self.command("URG")
        self.wait(seconds)

    async def told(self, text: str) -> str:
        """The text after the code in the reply to a command of the body."""
        return (await self.ask(f"&{BODY:02X}{text}")).removeprefix(f">&{BODY:02X}{text[:3]}")

    async def value(self, memory: str) -> int:
        return int(await self.told(f"UDD{memory}"))

    async def result_of(self, source: str, seconds: float = A_WHILE_S) -> int:
        """The value that a program leaves in the result buffer when it has ended normally."""
        await self.run(f"{source}\nLD D199, RX\nEND", seconds)
        assert await self.told("URD") == "H00", source
        return await self.value("D199")

    def inputs(self, *numbers: int) -> None:
        """Switch these inputs on, and the others off."""
        self.change(inputs=sum(1 << number for number in numbers))

    async def outcome(self) -> tuple[str, str, str]:
        """The outputs, how the program stands, and where."""
        return await self.told("COD"), await self.told("URD"), await self.told("UND")

    async def at_rest(self) -> None:
        """Wait for the end of the move, and for the program to see it."""
        while await self.told("9CD0") == "1":
            self.wait(0.01)
        self.wait(A_WHILE_S)


# 15.2.6: made, told, run


async def test_a_program_is_made_told_and_run_as_printed() -> None:
    host = Programmer(0x01)
    await host.play("""
        &01UCS
        >&01UCS
        &01UWSEAS0
        >&01UWS
        &01UWS1+M10000
        >&01UWS
        &01UWSJON MT, +0
        >&01UWS
        &01UED
        >&01UED00003
        &01UWSEND
        >&01UWS
        &01UWD0
        >&01UWDEAS0
        &01UWD
        >&01UWD1+M10000
        &01UPD
        >&01UPD00002,JONMT,+0
        &01URG
        >&01URG
        &01URD
        >&01URDH01
    """)
    host.wait(10)
    await host.play("""
        &01URD
        >&01URDH00
        &01UND
        >&01UND00003
        &016PD
        >&016PD+000010000
    """)


async def test_an_instruction_is_told_as_it_is_kept() -> None:
    """15.2.6, of another program: a blank that was not sent is not told."""
    await ClockHost(0x01).play("""
        &01UCS
        >&01UCS
        &01UWSEAS 1
        >&01UWS
        &01UWS00M
        >&01UWS
        &01UWD0
        >&01UWDEAS1
        &01UWD
        >&01UWD00M
    """)


async def test_a_program_runs_from_a_label_and_from_an_address() -> None:
    for start, stepped in (("URG*ST1", False), ("URG40", False), ("USG*ST1", True), ("USG40", True)):
        host = Programmer()
        await host.store("RST M0\n" * 39 + "*ST1\nSET M1\nLD D0, M0, 1\nEND")
        await host.command(start)
        host.wait(A_WHILE_S)
        assert await host.told("URD") == ("H80" if stepped else "H00")
        assert await host.told("UND") == ("00041" if stepped else "00042")
        if stepped:
            await host.command("USG")
        assert await host.value("D0") == 2


async def test_a_label_is_refused_a_second_time() -> None:
    host = Programmer()
    await host.command("UWS*ST1")
    assert await host.told("UWS*ST1") == "@4A"


# 15.2.7: the two examples

EXAMPLE_1 = """
    COSH0           ; 0  all outputs off
    00M             ; 1  search the origin
    JON MT, +0      ; 2
    SET OD0         ; 3  tell that it is found
    JOF ID0, +0     ; 4  wait for the start
    RST OD0         ; 5
    1AM25000        ; 6
    JOF MT, +3      ; 7  has it arrived?
    JOF ID6, +4     ; 8  has somebody interrupted it?
    JMP -2          ; 9
    SET OD1         ; 10 tell that it has arrived
    END             ; 11
    5IS             ; 12
    SET OD2         ; 13 tell that it was interrupted
    END             ; 14
"""


async def example_1_under_way() -> Programmer:
    host = Programmer()
    host.inputs(6)
    await host.command("COSHFFFF")
    await host.run(EXAMPLE_1)
    assert (await host.told("COD"), await host.told("UND")) == ("H0000", "00002")
    await host.at_rest()
    assert (await host.told("COD"), await host.told("UND")) == ("H0001", "00004")
    host.inputs(0, 6)
    host.wait(A_WHILE_S)
    assert (await host.told("COD"), await host.told("9CD0")) == ("H0000", "1")
    return host


async def test_example_1_tells_that_it_has_arrived() -> None:
    host = await example_1_under_way()
    await host.at_rest()
    assert await host.told("6PD") == "+000025000"
    assert await host.outcome() == (
        "H0002",
        "H00",
        "00011",
    )


async def test_example_1_stops_when_it_is_interrupted() -> None:
    host = await example_1_under_way()
    host.inputs(0)
    host.wait(A_WHILE_S)
    assert (await host.told("9CD0"), await host.told("9MD")) == ("0", "H10")
    assert 0 < int(await host.told("6PD")) < 25_000
    assert await host.outcome() == (
        "H0004",
        "H00",
        "00014",
    )


EXAMPLE_2 = "\n".join(
    f"""
    *{label}
    SET OD0
    1AM{position}
    JON MT, +0
    WAT 5
    RST OD0
    END"""
    for label, position in (("TEST", 5000), ("TEST2", 10_000), ("TEST3", 15_000))
)


@pytest.mark.parametrize(
    ("start", "position", "end"),
    [("URG", 5000, 6), ("URG*TEST", 5000, 6), ("URG*TEST2", 10_000, 13), ("URG*TEST3", 15_000, 20)],
)
async def test_example_2_has_three_programs(start: str, position: int, end: int) -> None:
    """Its text calls the first one *TEST1, which its table has not."""
    host = Programmer()
    assert (await host.store(EXAMPLE_2)).labels == {"TEST": 0, "TEST2": 7, "TEST3": 14}
    assert await host.told("URG*TEST1") == "@5B"
    await host.command(start)
    host.wait(A_WHILE_S)
    assert await host.told("COD0") == "1"
    await host.at_rest()
    assert int(await host.told("6PD")) == position
    assert (await host.told("COD0"), await host.told("URD")) == ("1", "H01"), "it waits for half a second"
    host.wait(0.45)
    assert (await host.told("COD0"), await host.told("URD")) == ("0", "H00")
    assert int(await host.told("UND")) == end


# 15.2.5, 16: the examples of the pages


async def test_a_data_memory_is_a_parameter() -> None:
    host = Programmer()
    await host.run("LD D1, 10000\n3PS P[0], D1\nEND")
    assert await host.told("3PDP[0]") == "+000010000"


async def test_an_index_is_the_number_of_a_memory() -> None:
    host = Programmer()
    await host.run("LD D10, 77\nLD IX, 10\nLD IY, 10\nLD D0, DIX\nLD D1, DIY\nEND")
    assert (await host.value("D0"), await host.value("D1")) == (77, 77)


@pytest.mark.parametrize(
    ("source", "memory", "value"),
    [
        ("ADD D0, 1000", "D0", 1000),
        ("LD D0, 1\nLD D10, 5\nADD D0, D10", "D0", 6),
        ("BST D0, 2, 1", "D0", 4),
        ("LD D1, 9\nDIV D1, 2", "D1", 4),
        ("LD D1, 9\nLD D5, 3\nDIV D1, D5", "D1", 3),
        ("CTS C1, 0\nINC C1", "C1", 1),
        ("SUB D0, 1000", "D0", -1000),
        ("LD D10, 5\nSUB D0,D10", "D0", -5),
        ("SET M100\nLD D0, M100, 0", "D0", 1),
        ("SET M10\nRST M10\nLD D0, M10, 0", "D0", 0),
        ("SET OD1\nLD D0, OD0, 2", "D0", 2),
        ("LD D0, 1\nJMP *STEP_1\nLD D0, 2\n*STEP_1\nLD D0, 1000", "D0", 1000),
    ],
)
async def test_the_examples_compute(source: str, memory: str, value: int) -> None:
    host = Programmer()
    await host.run(f"{source}\nEND")
    assert (await host.told("URD"), await host.value(memory)) == ("H00", value)


@pytest.mark.parametrize(
    ("source", "memory", "bits"),
    [("LD D12, HA0AAAAAA\nRSL D12", "D12", "H41555555"), ("LD D13, H50555555\nRSR D13", "D13", "HA82AAAAA")],
)
async def test_the_examples_rotate(source: str, memory: str, bits: str) -> None:
    host = Programmer()
    await host.run(f"{source}\nEND")
    assert await host.told(f"UDDH{memory}") == bits


JUMPS = [
    ("JCP D0 > 1000, *ST1", "LD D0, 1001", "LD D0, 1000"),
    ("JCP PP < 0, +5", "6PS-1", "6PS0"),
    ("JON M3, *Error1", "SET M3", "RST M3"),
    ("JOF ID3, *ST3", "", None),
    ("JOF T10, *Time_up", "", "TMS T10, 5"),
    ("JON T2, *ST1", "TMS T2, 5", ""),
]


@pytest.mark.parametrize(("jump", "taken", "not_taken"), JUMPS)
async def test_the_examples_jump(jump: str, taken: str, not_taken: str | None) -> None:
    label = jump.partition("*")[2] or "ST1"
    after = f"LD D9, 1\nEND\n*{label}\nLD D9, 2\nLD D9, 2\nEND"
    for first, mark in ((taken, 2), (not_taken, 1)):
        if first is not None:
            host = Programmer()
            await host.run(f"{first}\n{jump}\n{after}")
            assert await host.value("D9") == mark, first


async def test_an_input_that_is_on_lets_a_program_pass() -> None:
    host = Programmer()
    host.inputs(3)
    await host.run("JOF ID3, *ST3\nLD D9, 1\nEND\n*ST3\nEND")
    assert await host.value("D9") == 1


async def test_a_timer_that_counts_leads_three_addresses_back() -> None:
    host = Programmer()
    await host.run("TMS T2, 5\nINC D9\nWAT 2\nRST M0\nJON T2, -3\nEND", seconds=1)
    assert (await host.told("URD"), await host.value("D9")) == ("H00", 3)


async def test_a_timer_is_waited_for_unless_an_input_comes() -> None:
    source = "TMS T0, 100\nJON ID1, *ST1\nJON T0, -1\nLD D9, 1\nEND\n*ST1\nLD D9, 2\nEND"
    for pressed, mark in ((False, 1), (True, 2)):
        host = Programmer()
        await host.run(source, seconds=9.9)
        assert await host.told("URD") == "H01"
        if pressed:
            host.inputs(1)
        host.wait(0.2)
        assert (await host.told("URD"), await host.value("D9")) == ("H00", mark)


async def test_a_subroutine_is_called_and_left() -> None:
    host = Programmer()
    await host.run("CAL *TEST\nSET M0\nLD D0, M0, 1\nEND\n*TEST\nSET M1\nRET")
    assert (await host.told("URD"), await host.value("D0")) == ("H00", 3)


@pytest.mark.parametrize(("jump", "taken"), [("JER * Error", True), ("JER6, * Error", False), ("EED", True)])
async def test_errors_lead_out(jump: str, taken: bool) -> None:
    host = Programmer()
    await host.command("1+MZ")
    host.change(forced={2: True})
    host.change(forced={})
    assert await host.told("9CD") == "H02"
    await host.run(f"{jump}\nLD D0, 1\nEND\n*Error\nEND")
    assert await host.value("D0") == (0 if taken else 1)
    assert await host.told("URD") == ("H10" if jump == "EED" else "H00")


async def test_a_program_waits_for_the_motor_and_then_three_seconds() -> None:
    host = Programmer()
    await host.run("1AM10000\nJON MT, +0\nWAT30\nEND")
    await host.at_rest()
    host.wait(2.8)
    assert (await host.told("URD"), await host.told("UND")) == ("H01", "00002")
    host.wait(0.2)
    assert (await host.told("URD"), await host.told("6PD")) == ("H00", "+000010000")


MESSAGES = "SDC D0=\nJMG +0\nSDD D0\nJMG +0\nSDC ERROR!!\nJMG +0\nSDD C10\nJMG +0\nEND"


async def test_messages_reach_the_host_after_xid() -> None:
    host = Programmer()
    await host.command("UDSD0,-5", "UDSC10,99")
    await host.run(MESSAGES)
    assert (host.unheard(), await host.told("URD"), await host.told("UND")) == ("", "H01", "00001")
    await host.play("""
        &7FXID
        >&7FXID3F
        >&7CUSD[3F:D0=]
        >&7CUSD[3F:-000000005]
        >&7CUSD[3F:ERROR!!]
        >&7CUSD[3F:+000000099]
    """)
    host.wait(A_WHILE_S)
    assert await host.told("URD") == "H00"


async def test_a_move_of_a_program_is_reported_as_any() -> None:
    host = Programmer()
    await host.ask("&7FXRSM1")
    await host.store("1+M500\nJON MT, +0\nEND")
    await host.command("URG")
    assert await host.hear() == ">&7D1+M[3F:00]"


# 14: the programs of the command pages, and what they leave in the result buffer

SET_D0_12 = "LD D0, 12\n"
RESULTS = [
    ("0BS2", "0BD", 2),
    ("0RS2", "0RD", 2),
    ("0SS20", "0SD", 20),
    ("3IS50", "3ID", 50),
    ("3PSP[50],500", "LD D0, 50\n3PDP[D0]", 500),
    ("6ES50000", "6ED", 50_000),
    ("6ES50000", "6MD", 50_000),
    ("6PS50000", "6PD", 50_000),
    ("", "1+MZ\n9CD", 1),
    ("", "9MD", 0),
    ("EAS2 CCS50", "CCD", 50),
    ("COSH003D", "COD", 0x3D),
    ("CPS8,2", "LD D0, 8\nCPDD0", 2),
    ("", "CRD", 0),
    ("DISH032F", "DID", 0x32F),
    ("", "EAD", 0),
    ("EDS1", "EDD", 1),
    ("OASS[12],35", SET_D0_12 + "OADS[D0]", 35),
    ("OHSS[12],50000", SET_D0_12 + "OHDS[D0]", 50_000),
    ("OLSS[12],50", SET_D0_12 + "OLDS[D0]", 50),
    ("OSSS[12],800000", SET_D0_12 + "OSDS[D0]", 800_000),
    ("PAS4", "PAD", 4),
    ("PBS200.00", "PBD", 200),
    ("PES128", "PED", 128),
    ("EAS1 PJS1", "PJD", 1),
    ("EAS1 PKS800", "PKD", 800),
    ("EAS1 PLS1000", "PLD", 1000),
    ("", "PRD", 0),
    ("PSS1", "PSD", 1),
    ("EAS1 PTS3", "PTD", 3),
    ("QIS100", "QID", 100),
    ("", "QRD", 0),
    ("QSS1", "QSD", 1),
]


@pytest.mark.parametrize(("prepared", "source", "value"), RESULTS)
async def test_what_a_command_answers_goes_into_the_result_buffer(
    prepared: str, source: str, value: int
) -> None:
    host = Programmer()
    await host.command(*prepared.split())
    assert await host.result_of(source) == value
    assert host.unheard() == "", "no reply goes to the host"


async def test_inputs_and_sensors_go_into_the_result_buffer() -> None:
    host = Programmer()
    host.inputs(2, 3, 4, 5)
    host.change(forced={2: True, 3: True})
    assert await host.result_of("CID") == 0x3C
    assert await host.result_of("CLD") == 0x0C


async def test_a_distance_to_the_origin_and_an_error_output_go_into_the_result_buffer() -> None:
    """0PD: 10,000; CRD: H4, once the CW limit has stopped a move."""
    host = Programmer()
    host.change(origin=Span(-10_100, -9_990))
    await host.command("OLS30000", "00M")
    await host.at_rest()
    assert await host.result_of("0PD") == 10_000
    await host.command("CESL,2,1", "1+MZ")
    host.change(forced={CW_LIMIT: True})
    assert await host.result_of("CRD") == 0x4


EFFECTS = [
    ("LD D0, 2\n0BSD0", "0BD", "2"),
    ("LD D0, 2\n0RS D0", "0RD", "2"),
    ("LD D0, 30\nLD D1, 50000\n3PSP[D0], D1", "3PDP[30]", "+000050000"),
    ("LD D0, 5000\n6ES D0", "6ED", "+000005000"),
    ("LD D0, 5000\n6PSD0", "6PD", "+000005000"),
    ("LD D0, 2\nLD D1, 1\nCESE, D0, D1", "CEDE", "2,1"),
    ("LD D0, H003D\nCOSD0", "COD", "H003D"),
    ("LD D0, 8\nLD D1, 1\nCPSD0, D1", "CPD8", "1"),
    ("LD D0, 8\nLD D1, -50\nLD D2, 50\nCSSD0, D1, D2", "CSD8", "-000000050,+000000050"),
    ("LD D0, 1\nDLS D0", "DLD", "H01"),
    ("LD D0, 1\nDLS D0, D0", "DLD", "H02"),
    ("LD D0, 0\nEASD0", "EAD", "0"),
    ("LD D0, 1\nEDSD0", "EDD", "1"),
    ("LD D0, 12\nLD D1, 35\nOBSS[D0], D1", "OBDS[12]", "035"),
    ("LD D0, 12\nLD D1, 50000\nOHSS[D0], D1", "OHDS[12]", "00050000"),
    ("LD D0, 12\nLD D1, 50\nOLSS[D0], D1", "OLDS[12]", "00000050"),
    ("LD D0, 12\nLD D1, 800000\nOSSS[D0], D1", "OSDS[12]", "00800000"),
    ("LD D0, 4\nPASD0", "PAD", "4"),
    ("PBS200.00", "PBD", "00200.00"),
    ("LD D0, 128\nPESD0", "PED", "00128"),
    ("EAS1\nLD D0, 800\nPKSD0", "PKD", "00800"),
    ("EAS1\nLD D0, 500\nPLSD0", "PLD", "00000500"),
    ("EAS1\nLD D0, 3\nPTSD0", "PTD", "00003"),
    ("LD D0, 100\nQIS D0", "QID", "00100"),
    ("LD D0, 1\nQSSD0", "QSD", "1"),
    ("LD D0, 1\nPSSD0", "PSD", "1"),
    ("LD D0, 200\nCBS1, D0", "COD", "H0002"),
    ("EAS2\nLD D0, 50\nCCSD0", "CCD", "000000050"),
    ("EAS2\nLD D0, 0\nCLSD0", "COD", "H0000"),
    ("EAS1\nLD D0, 1\nPJS D0", "PJD", "1"),
    ("3PSP[0], 5\n3CS", "3PDP[0]", "+000000000"),
    ("1+MZ\n5DS", "9CD0", "1"),
    ("1+MZ\n5IS", "9MD", "H10"),
    ("1+MZ\n5SS", "9MD", "H10"),
]
"""Commands as printed, but for the brackets lost in OADD0, 1AMD0, 2-MD0 and OHS[D0] (OADS[D0] ...)."""


@pytest.mark.parametrize(("source", "asked", "reply"), EFFECTS)
async def test_memories_set_what_a_command_sets(source: str, asked: str, reply: str) -> None:
    host = Programmer()
    await host.run(f"6PD\nLD D100, 1\n{source}\nEND")
    assert await host.told("URD") == "H00"
    assert await host.told(asked) == reply


@pytest.mark.parametrize("move", ["1+M", "1-M", "2+M", "2-M", "1AM", "2AM"])
async def test_memories_move_the_motor(move: str) -> None:
    host = Programmer()
    speeds = ("OLSS[3],500", "OHSS[3],5000", "OSSS[3],50000", "OASS[3],50", "OBSS[3],50")
    await host.command(*speeds, "SPSA[3],A:S[3],D:S[3]")
    await host.run(f"LD D0, 3\nLD D1, 500\n{move}A[D0], D1\nJON MT, +0\nEND", seconds=5)
    assert await host.told("URD") == "H00"
    assert int(await host.told("6PD")) == (-500 if "-" in move else 500)


@pytest.mark.parametrize("search", ["00M", "01M", "02M", "03M", "04M", "0QM"])
async def test_a_program_searches_the_origin(search: str) -> None:
    host = Programmer()
    await host.command("OLS500", "QSS1", "QIS100")
    host.change(slits=Slits(-20, 100), ccw_limit=Span(-5_000, -4_900))
    await host.run(f"6PS700\n{search}\nJON MT, +0\nEND", seconds=60)
    assert (await host.told("URD"), await host.told("9MD")) == ("H00", "H00")
    assert await host.told("6PD") == "+000000000"


async def test_a_program_clears_the_status() -> None:
    host = Programmer()
    assert (await host.told("XXX"), await host.told("9CD")) == ("@49", "H08")
    await host.run("9CS\nEND")
    assert (await host.told("URD"), await host.told("9CD")) == ("H00", "H00")


@pytest.mark.parametrize(("release", "told"), [("QRS", "QRD0"), ("CRS", "CRDH0")])
async def test_a_program_clears_what_an_error_has_left(release: str, told: str) -> None:
    """A STALL error of the sensor, and the output that it drives."""
    host = Programmer()
    await host.command("CESS,2,1", "QSS1", "QIS100", "OLS500")
    host.change(forced={STALL: True})
    await host.command("0QM")
    await host.at_rest()
    assert (await host.told("9MD"), await host.told("CRD"), await host.told("QRD")) == ("H01", "H2", "1")
    await host.run(f"{release}\nEND")
    assert await host.told("URD") == "H00"
    assert await host.told(told[:3]) == told[3:]


async def test_a_program_clears_a_stall_that_the_encoder_has_found() -> None:
    host = Programmer()
    await host.command("PSS1", "6PS1000", "1+M5000")
    await host.at_rest()
    assert await host.told("PRD") == "1"
    await host.run("PRS\nEND")
    assert (await host.told("URD"), await host.told("PRD")) == ("H00", "0")
