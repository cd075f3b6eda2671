"""Every command of the C-HOST manual in both modes, as bytes, at each port.

The dialogues are written from the manual. How it writes numbers is lost with its figures: positions have a
point (2-9) and are expected with two decimals, all others in their shortest form. Units 1 and 2 have the axes
X Y Z and @; X and Y of unit 1, a miniSCARA, are converted from the motors A and B, and at their origin stand
at X 150, Y 150.
"""

import re
from contextlib import suppress
from pathlib import Path
from typing import NamedTuple

import pytest

from protocols.fics.commands import ROWS, read
from protocols.table import WireFault
from simulator.fics.layout import Layout
from simulator.fics.line import LineSettings, build_line
from tests.contract.fics_hosts import CR, PORTS, Host, StoppedClock

STEP = re.compile(r"([23]?)> (.*)|\+([0-9.]+)|(\.\.\.)|(.+)")
"""`> ANSWER` must be heard next, `2>` and `3>` in one mode alone; `+1.5` lets seconds pass, `...` lets all
motion end; anything else is sent. A `_` in an answer is a blank, as in C-HOST manual 2-13."""

HOME = """
    ORG
    ...
    3> ORG
"""

THREE_POSITIONS = """
    POF 1,1997
    3> POF
    POS 160,140,-5,90
    3> POS
    POS ,,12.5
    3> POS
    POS 150,150,0,0
    3> POS
    POF 2
    3> POF
"""

DIALOGUES = {
    "2-1 UNT": """
        UNT
        > UNT 1,1
        UNT 2
        3> UNT
        UNT
        > UNT 2,2
        UNT 3
        3> UNT E05
        ERR
        > ERR E05
    """,
    "2-2 JOG until it is stopped, at a tenth of the top speed": f"""
        {HOME}
        JOG Z+
        3> JOG
        +1
        ACD
        > ACD 1300,1300,1700,1300
        JOG Z
        3> JOG
        ...
        APS
        > APS 150.00,150.00,30.00,0.00
        ACD
        > ACD 0300,0300,0300,0300
    """,
    "2-2 JOG of several motors, and of one converted axis alone": f"""
        JOG A+
        3> JOG
        JOG @-
        3> JOG
        JOG A-
        3> JOG E01
        JOG X+
        3> JOG E01
        ACD
        > ACD 1600,1200,1200,1600
        JOG A
        3> JOG
        JOG @
        3> JOG
        ...
        JOG X+
        3> JOG E10
        {HOME}
        JOG X-
        3> JOG
        JOG Y-
        3> JOG E01
        JOG Z+
        3> JOG E01
        JOG X
        3> JOG
        ...
        JOG K+
        3> JOG E05
        JOG ++
        3> JOG E06
        ERR
        > ERR E06
    """,
    "2-3 JTE in the smallest amounts displayed, homed or not": f"""
        JTE A5
        ...
        3> JTE
        JTE X5
        3> JTE E10
        ERR
        > ERR E10
        {HOME}
        JTE Z+10
        ...
        3> JTE
        JTE Z-255
        ...
        3> JTE
        JTE @255
        ...
        3> JTE
        JTE X-1
        ...
        3> JTE
        APS
        > APS 149.99,150.00,-2.45,2.55
        JTE Z256
        3> JTE E05
        JTE Z0
        3> JTE E05
        ERR
        > ERR E05
    """,
    "2-4 ORG": """
        APS
        > APS #####,#####,#####,#####
        ORG
        +1
        ACD
        > ACD 3600,3600,3600,3600
        MPS
        > MPS #####,#####,#####,#####
        ...
        3> ORG
        APS
        > APS 150.00,150.00,0.00,0.00
        ACD
        > ACD 0300,0300,0300,0300
    """,
    "2-5 LMI": f"""
        LMI ,,-22
        ...
        3> LMI
        ASD
        > ASD 0,0,1,0
        {HOME}
        LMI 10,-20.5,+0030,
        +0.1
        ACD
        > ACD 2700,2700,2700,2300
        ...
        3> LMI
        LMI ,,-0.25,90
        ...
        3> LMI
        APS
        > APS 160.00,129.50,29.75,90.00
        LMI ,,70.26
        3> LMI E07
        ERR
        > ERR E07
    """,
    "2-6 LMA": f"""
        LMA ,,10
        3> LMA E10
        ERR
        > ERR E10
        {HOME}
        LMA 140.5,160,-30,45
        ...
        3> LMA
        APS
        > APS 140.50,160.00,-30.00,45.00
        LMA ,,100
        ...
        3> LMA
        APS
        > APS 140.50,160.00,100.00,45.00
        LMA ,,100.01
        3> LMA E07
        LMA 0,0,0,0,0
        3> LMA E06
        LMA ,
        3> LMA E06
        ERR
        > ERR E06
    """,
    "2-6 LMA out of the arms' reach": f"""
        {HOME}
        MSM ,-100
        3> MSM
        LMA 260,260
        3> LMA 183
        ERR
        > ERR 183
        ERD
        > ERD -183000000001
        LMA 140,140
        3> LMA E02
        DRT
        3> DRT
        ERR
        > ERR E02
    """,
    "2-7 AES stops at once and stays until DRT": f"""
        {HOME}
        LMA ,,30
        +0.1
        APS
        > APS 150.00,150.00,7.50,0.00
        AES
        3> AES
        3> LMA 001
        APS
        > APS 150.00,150.00,7.50,0.00
        ACD
        > ACD 5100,5100,5100,5100
        ERR
        > ERR 001
        ERR
        > ERR 001
        ERD
        > ERD ----E__
        LMA ,,30
        3> LMA E02
        DRT
        3> DRT
        ERR
        > ERR E02
        LMA ,,30
        ...
        3> LMA
        APS
        > APS 150.00,150.00,30.00,0.00
    """,
    "2-8 ASS ramps down": f"""
        {HOME}
        LMA ,,30
        +0.1
        ASS
        ASS
        3> ASS E04
        ...
        3> ASS
        3> LMA
        APS
        > APS 150.00,150.00,15.00,0.00
        ERR
        > ERR E04
        ASS
        3> ASS
        ERR
        > ERR E00
    """,
    "2-9 APS, 4-4 MPS": f"""
        APS
        > APS #####,#####,#####,#####
        MPS
        > MPS #####,#####,#####,#####
        {HOME}
        APS
        > APS 150.00,150.00,0.00,0.00
        MPS
        > MPS 0.00,0.00,0.00,0.00
        UNT 2
        3> UNT
        LMA -10,0.01,,-0.5
        ...
        3> LMA
        APS
        > APS -10.00,0.01,0.00,-0.50
        MPS
        > MPS -10.00,0.01,0.00,-0.50
    """,
    "2-10 ACD": """
        ACD
        > ACD 0200,0200,0200,0200
        ACD 1
        3> ACD E06
        ERR
        > ERR E06
    """,
    "2-11 ASD": """
        ASD
        > ASD 0,0,0,0
        LMI ,,-150
        ...
        3> LMI 002
        ASD
        > ASD 0,0,4,0
        ACD
        > ACD 0200,0200,08F0,0200
        ERD
        > ERD 1ZF0__-
        DRT
        3> DRT
        LMI ,,300
        ...
        3> LMI 002
        ASD
        > ASD 0,0,2,0
        ERD
        > ERD 1ZF0_+_
    """,
    "2-12 ERR": """
        ERR
        > ERR E00
        VAO 0
        3> VAO E05
        ERR
        > ERR E05
        ERR
        > ERR E00
        lma 1
        3> E06
        ERR
        > ERR E06
        ÄÖÜ
        3> E99
        ERR
        > ERR E99
    """,
    "2-13 ERD, 2-14 DRT": """
        ERD
        > ERD ----
        DRT
        3> DRT
        AES
        3> AES
        ERD
        > ERD ----E__
        DRT
        3> DRT
        ERD
        > ERD ----
    """,
    "2-15 VAO": """
        VAO
        > VAO 100.0,100.0,100.0,100.0
        VAO 10,,30,,
        3> VAO
        VAO
        > VAO 10.0,100.0,30.0,100.0
        VAO ,0.1
        3> VAO
        VAO
        > VAO 10.0,0.1,30.0,100.0
        VAO 100.1
        3> VAO E05
        VAO 0
        3> VAO E05
        VAO 99.999
        3> VAO E05
        VAO
        > VAO 10.0,0.1,30.0,100.0
        ERR
        > ERR E05
    """,
    "2-16 POM": f"""
        {HOME}
        {THREE_POSITIONS}
        POM 1997
        ...
        3> POM
        APS
        > APS 160.00,140.00,-5.00,90.00
        POM 1998
        ...
        3> POM
        APS
        > APS 160.00,140.00,12.50,90.00
        POM 1
        3> POM E09
        ERR
        > ERR E09
        POM 2000
        3> POM E05
        POM
        3> POM E06
        ERR
        > ERR E06
    """,
    "2-17 POF, 2-18 POS, 2-19 POR": f"""
        POS 1
        3> POS E08
        ERR
        > ERR E08
        {THREE_POSITIONS}
        POR 1997
        > POS 160,140,-5,90
        > POS ,,12.5
        > POS 150,150,0,0
        > POE
        POR 1998,1
        > POS ,,12.5
        > POE
        POR
        > POE
        POF 1
        3> POF
        POS 1,2,3,4
        3> POS
        POR
        3> POR E03
        AES
        3> AES E03
        ERR
        > ERR E03
        POF 2
        3> POF
        POR ,1
        > POS 1,2,3,4
        > POE
        POR 1,2000
        3> POR E05
        ERR
        > ERR E05
    """,
    "2-18 POS up to number 1999, and of no more axes than there are": """
        POF 1,1999
        3> POF
        POS 1,2,3,4,5
        3> POS E11
        POS 5
        3> POS
        POS 6
        3> POS E11
        ERR
        > ERR E11
        POF 2
        3> POF
        POR 1999
        > POS 5
        > POE
        POF 1,2000
        3> POF E05
        POF 3
        3> POF E05
        ERR
        > ERR E05
    """,
    "2-20 PCL": f"""
        {THREE_POSITIONS}
        PCL 1998,1
        3> PCL
        POR 1997
        > POS 160,140,-5,90
        > POE
        POR 1999
        > POS 150,150,0,0
        > POE
        PCL ,1998
        3> PCL
        POR 1997
        > POE
        PCL
        3> PCL
        POR 1999
        > POE
        PCL 0
        3> PCL E05
        ERR
        > ERR E05
    """,
    "2-21 IDI, 2-22 IDO, 2-23 IOT": """
        IDI 1
        > IDI 00
        IDI 4
        > IDI FF
        IDI 5
        3> IDI E05
        ERR
        > ERR E05
        IOT 1-7:+
        3> IOT
        IOT 1-0:+
        3> IOT
        IDO 1
        > IDO 81
        IOT 1-7:-
        3> IOT
        IDO 1
        > IDO 01
        IOT 1-8:+
        3> IOT E05
        IOT 1-7
        3> IOT E06
        ERR
        > ERR E06
    """,
    "2-24 SCV": """
        SCV
        > SCV 0
        SCV 1
        3> SCV
        SCV
        > SCV 1
        UNT 2
        3> UNT
        SCV
        > SCV 0
        SCV 2
        3> SCV E05
        ERR
        > ERR E05
    """,
    "2-25 HMT": """
        HMT
        > HMT 0,0,0,0
        HMT 6,,4
        3> HMT
        HMT
        > HMT 6,0,4,0
        HMT 7
        3> HMT E05
        ERR
        > ERR E05
    """,
    "2-26 HMO": """
        HMO
        > HMO 0,0,0,0
        HMO ,-1.5,10
        3> HMO
        HMO
        > HMO 0,-1.5,10,0
    """,
    "2-27 HMV": """
        HMV
        > HMV 10,10,30,10
        HMV 9.5,,29
        3> HMV
        HMV
        > HMV 9.5,10,29,10
        HMV 0
        3> HMV E05
        ERR
        > ERR E05
    """,
    "2-28 HMB": """
        HMB
        > HMB 1,1,5,1
        HMB ,0.5
        3> HMB
        HMB
        > HMB 1,0.5,5,1
    """,
    "2-29 VSB": """
        VSB
        > VSB 0,0,0,0
        VSB 9999,,100
        3> VSB
        VSB
        > VSB 9999,0,100,0
        VSB 10000
        3> VSB E05
        ERR
        > ERR E05
    """,
    "2-30 VSO": """
        VSO
        > VSO 500,500,300,60
        VSO 300.0, 310.0, , 30
        3> VSO
        VSO
        > VSO 300,310,300,30
        VSO , 310.5, 400.0
        3> VSO
        VSO
        > VSO 300,310.5,400,30
    """,
    "2-31 VST, 2-32 VSS": """
        VST
        > VST 200,200,200,200
        VST 1,,9999
        3> VST
        VST
        > VST 1,200,9999,200
        VST 0
        3> VST E05
        VSS
        > VSS 200,200,200,200
        VSS ,150
        3> VSS
        VSS
        > VSS 200,150,200,200
        VSS ,10000
        3> VSS E05
        ERR
        > ERR E05
    """,
    "2-33 SLP, 2-34 SLM": """
        SLP
        > SLP 300,300,100,180
        SLP 250,,99.5
        3> SLP
        SLP
        > SLP 250,300,99.5,180
        SLM
        > SLM -300,-300,-100,-180
        SLM ,,99.5
        3> SLM
        SLM
        > SLM -300,-300,99.5,-180
        SLP ,,99.49
        3> SLP E05
        SLM ,,99.51
        3> SLM E05
        ERR
        > ERR E05
    """,
    "2-35 VAR": """
        VAR V99
        > VAR V99=+0
        VAR V99=-12.5
        3> VAR
        VAR V99
        > VAR V99=-12.5
        VAR V5=+007
        3> VAR
        VAR V05
        > VAR V05=+7
        VAR V100
        3> VAR E05
        ERR
        > ERR E05
    """,
    "2-36 VER": """
        VER
        2> VER DYNAX0010310041112SIMULATE______041215R01
        3> VER DYNAX0010310041112SIMULATE______041215R01H30
    """,
    # Whether MOD itself is answered is not printed: it is decided by the new mode.
    "2-37 MOD": """
        MOD
        2> MOD 2
        3> MOD 3
        MOD 4
        3> MOD E05
        MOD 3
        > MOD
        MOD
        > MOD 3
        MOD 2
        MOD
        > MOD 2
        ERR
        > ERR E05
    """,
    "3 macros": f"""
        {HOME}
        PCK 160,140,-5
        +0.1
        ACD
        > ACD 4700,4700,4300,4300
        APS
        > APS #####,#####,#####,#####
        ...
        3> PCK
        APS
        > APS 160.00,140.00,0.00,0.00
        IDO 1
        > IDO 01
        XYZ 1
        3> XYZ E12
        ERR
        > ERR E12
        PCK 1,2,3,4,5
        3> PCK E06
        ERR
        > ERR E06
    """,
    "4-2 MMI, 4-3 MMA of a miniSCARA": f"""
        MMI 10,,-22
        ...
        3> MMI
        MMA 10
        3> MMA E10
        ERR
        > ERR E10
        {HOME}
        MMA 90,,-30.5
        ...
        3> MMA
        MPS
        > MPS 90.00,0.00,-30.50,0.00
        APS
        > APS -150.00,150.00,-30.50,0.00
        MMI -90,,0.5,45
        ...
        3> MMI
        MPS
        > MPS 0.00,0.00,-30.00,45.00
        APS
        > APS 150.00,150.00,-30.00,45.00
        MMA ,80.01
        3> MMA E07
        ERR
        > ERR E07
    """,
    "4-2 MMI, 4-3 MMA of a Cartesian unit": f"""
        {HOME}
        UNT 2
        3> UNT
        MMA 90,,-30.5
        ...
        3> MMA
        MMI ,1.25
        ...
        3> MMI
        MPS
        > MPS 90.00,1.25,-30.50,0.00
        APS
        > APS 90.00,1.25,-30.50,0.00
    """,
    "4-5 MAO of both kinds of units": """
        MAO
        > MAO 100.0,100.0,100.0,100.0
        MAO 10,,30
        3> MAO
        MAO
        > MAO 10.0,100.0,30.0,100.0
        VAO
        > VAO 100.0,100.0,100.0,100.0
        MAO 100.1
        3> MAO E05
        ERR
        > ERR E05
        UNT 2
        3> UNT
        MAO 10,,30
        3> MAO
        VAO
        > VAO 100.0,100.0,100.0,100.0
        MAO
        > MAO 10.0,100.0,30.0,100.0
    """,
    "4-6 MSO of both kinds of units": """
        MSO
        > MSO 60,60,300,60
        MSO 30.0,,250.0
        3> MSO
        MSO
        > MSO 30,60,250,60
        VSO
        > VSO 500,500,250,60
        UNT 2
        3> UNT
        MSO 300.0,,250.0
        3> MSO
        MSO
        > MSO 300,500,250,60
        VSO
        > VSO 300,500,250,60
    """,
    "4-7 MST, 4-8 MSS of both kinds of units": """
        MST
        > MST 200,200,200,200
        MST 1,,9999
        3> MST
        MST
        > MST 1,200,9999,200
        VST
        > VST 200,200,9999,200
        MSS
        > MSS 200,200,200,200
        MSS ,150
        3> MSS
        MSS
        > MSS 200,150,200,200
        VSS
        > VSS 200,200,200,200
        MST 0
        3> MST E05
        UNT 2
        3> UNT
        MST 1
        3> MST
        MSS ,150
        3> MSS
        VST
        > VST 1,200,200,200
        VSS
        > VSS 200,150,200,200
    """,
    "4-9 MSP, 4-10 MSM of both kinds of units": """
        MSP
        > MSP 120,80,100,180
        MSP ,70.5
        3> MSP
        MSP
        > MSP 120,70.5,100,180
        MSM
        > MSM -120,-80,-100,-180
        MSM -110,,0
        3> MSM
        MSM
        > MSM -110,-80,0,-180
        SLM
        > SLM -300,-300,0,-180
        MSP ,,-0.01
        3> MSP E05
        MSM ,70.51
        3> MSM E05
        ERR
        > ERR E05
        UNT 2
        3> UNT
        MSP 120
        3> MSP
        MSM ,-70.5
        3> MSM
        SLP
        > SLP 120,300,100,180
        SLM
        > SLM -300,-70.5,-100,-180
    """,
}


class Step(NamedTuple):
    """One line of a dialogue: just one of the fields is given, but for `only_in`."""

    only_in: str
    answer: str
    seconds: str
    end: str
    command: str


def steps(script: str) -> list[Step]:
    found = (STEP.fullmatch(line.strip()) for line in script.splitlines())
    return [Step(*match.groups("")) for match in found if match]


async def play(host: Host, script: str, mode: str) -> None:
    for step in steps(script):
        if step.command:
            await host.send(step.command.encode() + CR)
        elif step.end:
            await host.finish()
        elif step.seconds:
            await host.wait(float(step.seconds))
        elif step.only_in in ("", mode):
            assert await host.hear() == step.answer.replace("_", " ").encode() + CR


@pytest.mark.anyio
@pytest.mark.parametrize("mode", ["2", "3"])
@pytest.mark.parametrize("port", PORTS)
@pytest.mark.parametrize("title", DIALOGUES)
async def test_it_is_answered_as_the_manual_says(title: str, port: str, mode: str, tmp_path: Path) -> None:
    line = build_line(Layout(units=2, axes="XYZ@"))
    line.robot.inputs[:] = [0x00, 0xA5, 0x0F, 0xFF]
    async with PORTS[port](StoppedClock(line), tmp_path / "fics") as host:
        if mode == "3":
            await play(host, "MOD 3\n> MOD", mode)
        await play(host, DIALOGUES[title], mode)
        # That this answer comes next proves that nothing else was said.
        await play(host, "IDI 2\n> IDI A5", mode)


def test_no_command_is_missing() -> None:
    sent = {step.command for script in DIALOGUES.values() for step in steps(script) if step.command}
    heard: set[type] = set()
    for command in sent:
        with suppress(WireFault):
            heard.add(type(read(command[:3], command[3:].replace(" ", ""))))
    assert set(ROWS) - heard == set()


@pytest.mark.anyio
@pytest.mark.parametrize("ending", ["\r\n", "\r"])
async def test_lines_end_as_set_up_and_may_come_with_either_ending(ending: str, tmp_path: Path) -> None:
    line = build_line(Layout(), settings=LineSettings(terminator="crlf" if "\n" in ending else "cr"))
    async with PORTS["dpram"](StoppedClock(line), tmp_path / "fics") as host:
        await host.send(f"UNT{ending}".encode())
        assert await host.hear() == f"UNT 1,1{ending}".encode()
        await host.send(b"\tU N T 1 \r\n")
        await host.send(b"UNT\r")
        assert await host.hear() == f"UNT 1,1{ending}".encode()
