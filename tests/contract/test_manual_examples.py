"""Every example of RC-420 manual 14, as bytes at a real port of the simulator."""

import asyncio
import re
from collections.abc import Awaitable, Callable
from pathlib import Path

import pytest

from protocols.rorze.commands import COMMANDS
from protocols.rorze.row import LAST_BODY
from simulator.rorze.world import CCW_LIMIT, CW_LIMIT, EMS, ORIGIN, STALL, Span
from tests.contract.hosts import BODY, ClockHost, Host, at_terminal

BODIES = (0x00, 0x02, 0x3F)
AT_ONCE = 48
"""Lines at one time: three file descriptors each."""

SPEEDS_3 = "OLSS[3],50 OHSS[3],{high} OSSS[3],{acceleration} OASS[3],50 OBSS[3],50 "
PATTERN_3 = SPEEDS_3 + "SPSA[3],A:S[3],D:S[3] "
ROBOT = "HTS0 HAS215000 HFS330000 HZS0,121791.045 HZS1,60000.000 HZS2,100000.000"
USUAL_3 = PATTERN_3.format(high=50_000, acceleration=100_000)
PLACED = f"{ROBOT} HPS0,-10149 HPS1,-10000 HPS2,-16666 {USUAL_3} SPSA[0],A:S[3],D:S[3] SPSA[1],A:S[3],D:S[3]"
ENTRY_25 = "3PSP[25],50 3IS25"
DISTANCES = USUAL_3 + "3PSP[50],700 3IS50"


async def homed_from_afar(host: Host) -> None:
    """The origin is 10,000 pulses CCW."""
    host.change(origin=Span(-10_100, -9_990))
    await host.command("OLS30000")
    await host.play("""
        &7FXRSM1
        >&7FXRS
        &3F00M
        >&3F00M
        >&7D00M[3F:00]
    """)


async def stalled(host: Host) -> None:
    """The STALL sensor never opens, so that the middle of the slit cannot be found."""
    host.change(forced={STALL: True})
    await host.command("ESSM,I", "OLS30000")
    await host.play("""
        &7FXRSM1
        >&7FXRS
        &3F0QM
        >&3F0QM
        >&7D0QM[3F:01]
    """)


async def stopped_at_a_limit(host: Host) -> None:
    await host.command("CESL,2,1", "1+MZ")
    host.change(forced={CW_LIMIT: True})


async def stopped_by_ems(host: Host) -> None:
    await host.command("CESE,2,1", "1+MZ")
    host.change(forced={EMS: True})


async def with_a_comment(host: Host) -> None:
    await host.command("9VS2,Serial No.00000152")


async def over_a_slit(host: Host) -> None:
    host.change(forced={STALL: True})


async def inputs_2_to_5_on(host: Host) -> None:
    host.change(inputs=0x3C)


async def on_the_dog_and_the_ccw_limit(host: Host) -> None:
    host.change(forced={ORIGIN: True, CCW_LIMIT: True})


def with_the_program(*instructions: str, asked: str = "") -> Callable[[Host], Awaitable[None]]:
    """A program in RAM, and what was asked of it before."""

    async def prepare(host: Host) -> None:
        host.line.axes[BODY].program = instructions
        if asked:
            await host.ask(f"&3F{asked}")

    return prepare


TS = (*("1+M50",) * 511, "*TS", "WAT5", "END")
ST1 = ("*ST1", *("WAT5",) * 125)

PREPARED: dict[str, str | Callable[[Host], Awaitable[None]]] = {
    "01M": "QSS1",
    "0QM": over_a_slit,
    "0PD+000010000": homed_from_afar,
    "0RD2": "0RS2",
    "0SD00020": "0SS20",
    **dict.fromkeys(("1+M", "1-M", "1AM", "2+M", "2-M", "2AM"), DISTANCES),
    "3ID0050": "3IS50",
    **dict.fromkeys(("3NDP[0025],+000000050", "3PD+000000050"), ENTRY_25),
    **dict.fromkeys(("5AS", "5CS", "5DS", "9CDH01"), "1+MZ"),
    "5MDS[12]": "5MSS[12]",
    "6ED+000050000": "6ES50000",
    "6MD+000050000": "6ES50000",
    "6PD+000050000": "6PS50000",
    "9VDSerial No.00000152": with_a_comment,
    "CCD000000050": "EAS2 CCS50",
    **dict.fromkeys(("CCS", "CLS"), "EAS2"),
    "CED2,1": "CESE,2,1",
    "CFD0025": "CFS8,P:25",
    "CFD5,1,00010": "CFS8,O:5,1,10",
    **dict.fromkeys(("CID1", "CIDH003C"), inputs_2_to_5_on),
    "CLDH0A": on_the_dog_and_the_ccw_limit,
    "COD1": "COS1,1",
    "CODH003D": "COSH003D",
    "CPD2": "CPS8,2",
    "CRD1": stopped_by_ems,
    "CRDH4": stopped_at_a_limit,
    "CSD-000000050,+000000050": "CSS8,-50,50",
    "DCD005": "DCS14,5",
    "DIDH003F": "DISH003F",
    **dict.fromkeys(("DLD1", "DLDH01"), "DLS0,1"),
    "EMDC:H06,M:H00,S:H00,I:H0001": "EMSC:H06,I:H0001",
    "EPD-000000500,+000000500": "EPS-500,500",
    "ERDM:H01,I:H0000": stalled,
    "ESDC,I,P": "ESSC,I,P",
    **dict.fromkeys(("H+S", "H-S", "HFM", "HXS", "HYS"), PLACED),
    "HAD+000156000": "HAS156000",
    "HCD1": "HCS1",
    "HDDX:200000,Y:100000,R:50000": "HDSH[3],1,X:200000,Y:100000,R:50000",
    "HDDCENTER": "HDSH[3],1,CENTER",
    "HFD300000": "HFS300000",
    "HLS0:-000010149,1:-000010000,2:-000016666": ROBOT,
    **dict.fromkeys(("HMS", "HNM"), PLACED + " HDSH[3],0,X:100000,Y:100000,R:0"),
    "HPD+000083333": "HPS0,83333",
    "HTD0": "HTS0",
    "HZD00005000.00": "HZS1,5000.00",
    "OAD035": "OASS[12],35",
    "OAD080": "OAS80",
    "OBD035": "OBSS[12],35",
    "OBD080": "OBS80",
    "OHD00005000": "OHS5000 OHSS[12],5000",
    "OLD00000050": "OLSS[12],50",
    "OSD00800000": "OSS800000 OSSS[12],800000",
    "PBD00200.00": "PBS200.00",
    "PJD1": "EAS1 PJS1",
    "PLD00001000": "EAS1 PLS1000",
    **dict.fromkeys(("PJS", "PKD00800", "PKS", "PLS", "PTD00003", "PTS"), "EAS1"),
    "PSD1": "PSS1",
    "QID00100": "QIS100",
    "QSD1": "QSS1",
    "SEDF5321,T8000,S5000": PATTERN_3.format(high=10_000, acceleration=28_019) + "SESA[3],2,F5321,S5000",
    "SES": USUAL_3,
    "SHD32275": PATTERN_3.format(high=50_000, acceleration=65_092),
    "SPDA:S[12],D:S[13]": "SPSA[3],A:S[12],D:S[13]",
    "SSDA:32275,D:12384": (
        SPEEDS_3.format(high=50_000, acceleration=77_408)
        + "OLSS[4],50 OHSS[4],50000 OSSS[4],202224 OASS[4],50 OBSS[4],50 SPSA[3],A:S[3],D:S[4]"
    ),
    "UAD1": "UAS1",
    "UBD01534": with_the_program(*("1+M50",) * 1501, "WAT5"),
    "UDD+000000099": "UDSC10,99",
    "UDDH000000FF": "UDSD0,HFF",
    "UED00534": with_the_program(*("1+M50",) * 534),
    "UND00125": with_the_program(*ST1, asked="URG125"),
    **dict.fromkeys(("UPD00511,*TS", "UPD00512,WAT5", "UWD*TS", "UWDWAT5"), with_the_program(*TS)),
    **dict.fromkeys(("URG", "USG"), with_the_program(*ST1)),
    **dict.fromkeys(("UPD00513,END", "UWDEND"), with_the_program(*TS, asked="UWD512")),
    "UWD": with_the_program(*TS, asked="UPD513"),
}
"""State that a reply (without its body number) needs: commands, or a hand on the plant.

The speeds behind the pulse counts of SED, SHD and SSD are not printed; these lead to them.
"""

BELT_LINKED = "HTS1 HAS156000 HFS208000 HZS0,98765.00 HZS1,99000.00"
TABLED = "3PSP[100],1000 3PSP[101],-2000 3PSP[102],3000 3PSP[103],200000 3PSP[104],100000"
STANDING = "HPS0,-10149 HPS1,-10000 HPS2,-16666"

FORMS = {
    "&02HLD0:-10149,1:-10000,2:-16666": ROBOT,
    "&01HLD0:1000,1:-2000": BELT_LINKED,
    "&01HLD0:P[100],1:P[101],2:P[102]": f"{ROBOT} {TABLED}",
    "&02HLD": f"{ROBOT} {STANDING}",
    "&01HLSX:200000,Y:100000": BELT_LINKED,
    "&01HLSX:P[103],Y:P[104]": f"{BELT_LINKED} {TABLED}",
}
"""Robots that commands need of whose replies only the form is right.

No robot of the manual stands there, or the page prints ideal coordinates not those of whole pulses (13.10.7).
"""

OF_GROUPS = {"&80HMM", "&80HRSA[3],R:150000,F:90000"}
"""Members answer them each for itself; they are among the examples of 13.10."""

EXAMPLES = [
    (command, reply)
    for row in COMMANDS.values()
    for command, reply in zip(row.example[::2], row.example[1::2], strict=True)
    if command not in FORMS.keys() | OF_GROUPS
]


def bodies_for(command: str) -> tuple[int, ...]:
    """The bodies of an example's line; the last is prepared."""
    body = int(command[1:3], 16)
    return (body,) if body <= LAST_BODY else BODIES


async def heard_after(path: Path, command: str, reply: str) -> bytes:
    """Every byte that a new line answers, once it has been prepared."""
    bodies = bodies_for(command)
    async with at_terminal(path, bodies) as host:
        preparation = PREPARED.get(reply[4:], "")
        if isinstance(preparation, str):
            await host.command(*preparation.split(), body=bodies[-1])
        else:
            await preparation(host)
        host.send(command)
        heard = b""
        while b"\r" not in heard:
            heard += await host.receive()
        return heard


def printed(reply: str) -> bytes:
    """The reply as a pattern: X stands for digits of a version and a date, which are a controller's own."""
    pattern = re.escape(reply) + r"\r"
    return (pattern.replace("X", r"\d") if reply.startswith(">&3F9VDRC-420") else pattern).encode()


@pytest.mark.anyio
async def test_every_example_is_answered_as_printed(tmp_path: Path) -> None:
    places = asyncio.Semaphore(AT_ONCE)

    async def heard_in_turn(place: int, command: str, reply: str) -> bytes:
        async with places:
            return await heard_after(tmp_path / str(place), command, reply)

    heard = await asyncio.gather(*(heard_in_turn(place, *example) for place, example in enumerate(EXAMPLES)))
    different = [
        (command, reply, answer)
        for (command, reply), answer in zip(EXAMPLES, heard, strict=True)
        if not re.fullmatch(printed(reply), answer)
    ]
    assert different == []


def test_no_preparation_is_left_over() -> None:
    assert PREPARED.keys() <= {reply[4:] for _, reply in EXAMPLES}


@pytest.mark.anyio
async def test_coordinates_are_answered_in_the_printed_form() -> None:
    numbers = re.compile(r"[+-]\d{9}")
    printed_replies = dict(
        pair for row in COMMANDS.values() for pair in zip(row.example[::2], row.example[1::2], strict=True)
    )
    for command, preparation in FORMS.items():
        (body,) = bodies_for(command)
        host = ClockHost(body)
        await host.command(*preparation.split(), body=body)
        assert numbers.sub("n", await host.ask(command)) == numbers.sub("n", printed_replies[command])
