"""The knowledge of the bodies of the demo: speeds, a lift's program, and three that make a SCARA robot."""

from typing import Final

from protocols.rorze.user_program.assembler import Assembled, assemble
from simulator.rorze.line import Rc400Line

SPEEDS: Final = (
    *("OLSS[12],5000", "OHSS[12],50000", "OSSS[12],70000", "OASS[12],30", "OBSS[12],30"),
    *("OLSS[0],50", "OHSS[0],50000", "OSSS[0],95000", "OASS[0],50", "OBSS[0],20"),
    *("SPSA[12],A:S[12],D:S[0]", "OLS1000"),
)
"""The speeds of RC-420 manual 13.3.4 as pattern 12, and a brisk homing."""

LIFT: Final = 0x3F
PROGRAM: Final = """\
; up, wait, down
*LIFT
    SET OD0             ; the output shows that it runs
    1AM A[12],5000
    JON MT, +0          ; wait for the motor
    WAT 5
    1AM A[12],0
    JON MT, +0
    RST OD0
    END
"""

SCARA: Final = {0x10: -10_149, 0x11: -10_000, 0x12: -16_666}
"""Base, arm and finger, and where they stand: RC-420 manual 13.10.7."""
GEOMETRY: Final = (
    *("HTS0", "HAS215000", "HFS330000", "HZS0,121791.045", "HZS1,60000.000", "HZS2,100000.000"),
    *("HDSH[0],0,X:255000,Y:300000,R:120000", "HDSH[0],1,X:255000,Y:450000,R:0"),
    *("OLSS[1],1000", "OHSS[1],1000000", "OSSS[1],5000000", "OASS[1],50", "OBSS[1],50"),
    *("OLSS[4],50", "OHSS[4],50000", "OSSS[4],100000", "OASS[4],50", "OBSS[4],50"),
    *("OLSS[3],1000", "OHSS[3],1000000", "OSSS[3],5000000", "OASS[3],50", "OBSS[3],50"),
    *("SPSA[1],A:S[1],D:S[1]", "SPSA[3],A:S[3],D:S[3]", "SPSA[4],A:S[4],D:S[4]", "SPSA[0],A:S[0],D:S[0]"),
    *("HDSH[3]", "HDSH[3],0,X:255000,Y:300000,R:120000", "HDSH[3],1,X:255000,Y:450000,R:0"),
)
"""The robot's lengths and paths 0 and 3; patterns 1 and 3 go along a path, 4 turns (13.10.3, 13.10.7)."""

AS_A_FINGER: Final = ("HCS2", "HPS0,-10149", "HPS1,-10000", "HPS2,0")
"""Commands that make another body the robot's finger, so that commands of robots can be tried at it, too."""


def teach(line: Rc400Line, now: float) -> None:
    """Let the bodies learn it, and keep it in flash memory."""
    for number, axis in line.axes.items():
        texts = [*SPEEDS, *GEOMETRY]
        if number in SCARA:
            texts += [f"HCS{list(SCARA).index(number)}", f"6PS{SCARA[number]}"]
        else:
            texts += AS_A_FINGER
        texts.append("FIS")
        if number == LIFT:
            texts += ["UCS", *(f"UWS{instruction}" for instruction in _instructions(PROGRAM)), "FUS"]
        for text in texts:
            if axis.execute(text, now).payload.startswith("@"):
                raise ValueError(f"body {number:02X} of the demo does not learn {text}")


def _instructions(source: str) -> list[str]:
    program = assemble(source)
    if not isinstance(program, Assembled):
        raise TypeError(f"the program of the demo has faults: {program}")
    return [instruction.text for instruction in program.instructions]
