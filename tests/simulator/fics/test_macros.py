"""Programs that the host can run by their names."""

from pathlib import Path

import pytest

from simulator.fics.layout import Layout
from simulator.fics.macros import MACROS, Macro, filled_in, pause_of, read_macros
from tests.simulator.fics.bench import Bench

MACROS_TOML = """
[macros.UPD]
program = 7
steps = ["LMI $1", "WAIT 0.5", "IOT 2-3:+", "VAR V9=$2", "VAO 50", "LMI -$1"]

[macros.2ND]
program = 8
steps = ["POM $1"]
"""


@pytest.fixture
def bench(tmp_path: Path) -> Bench:
    path = tmp_path / "macros.toml"
    path.write_text(MACROS_TOML)
    return Bench(Layout(axes="Z@W", macros=read_macros(path)))


def test_arguments_take_their_places() -> None:
    values = {1: 10.0, 2: -0.5, 3: None}
    assert filled_in("LMA $1,$2,$3,$4", values) == "LMA 10,-0.5,,"
    assert filled_in("LMI -$1,-$2,-$3", values) == "LMI -10,0.5,"
    assert filled_in("LMI -$1", {1: 0.0}) == "LMI 0"
    assert filled_in("ORG", values) == "ORG"


def test_a_pause_is_seconds() -> None:
    assert (pause_of("WAIT 0.25"), pause_of("WAIT 3"), pause_of("LMA 3")) == (0.25, 3.0, None)


def test_a_macro_does_its_steps_one_after_the_other(bench: Bench) -> None:
    assert bench.do("UPD 60,-4.5") == ["UPD"]
    places = [fact.facts["place"] for fact in bench.line.truth.of("axis_stop")]
    assert places == pytest.approx([60.0, 0.0])
    # Up at full speed, half a second's pause, down at half speed.
    assert bench.now == pytest.approx(0.4 + 0.5 + 0.5)
    assert bench.ask("IDO 2") == ["IDO 08"]
    assert bench.robot.variables[9] == -4.5


def test_ver_2_tells_nothing_of_its_end(bench: Bench) -> None:
    assert bench.ask("MOD 2") == []
    assert bench.do("UPD 60,1") == []
    assert bench.ask("ERR") == ["ERR E00"]
    assert bench.motor("Z").at == 0.0


def test_other_motion_and_other_macros_wait(bench: Bench) -> None:
    bench.ask("UPD 60")
    bench.wait(0.6)
    assert bench.ask("2ND 1") == ["2ND E01"]
    assert bench.ask("LMI 1") == ["LMI E01"]
    assert bench.ask("ACD") == ["ACD 4200,4200,4200"]


@pytest.mark.parametrize(
    ("text", "answer"),
    [
        ("XYZ 1", ["XYZ E12"]),
        ("PCK 1,2,3", ["PCK E12"]),
        ("123", ["123 E12"]),
        ("UPD 1,2,3,4,5", ["UPD E06"]),
        ("UPD A", ["UPD E06"]),
        ("2ND 1 1", ["2ND 209"]),
    ],
)
def test_unknown_macros_and_wrong_arguments_are_refused(bench: Bench, text: str, answer: list[str]) -> None:
    assert bench.ask(text) == answer


@pytest.mark.parametrize("text", ["upd 1", "UP", "U*D 1"])
def test_what_looks_like_no_name_is_a_format_error(bench: Bench, text: str) -> None:
    assert bench.ask(text) == ["E06"]
    assert bench.ask("ERR") == ["ERR E06"]


@pytest.mark.parametrize("moment", [0.1, 0.6, 1.2])
def test_a_decelerating_stop_ends_it_for_good(bench: Bench, moment: float) -> None:
    bench.ask("UPD 60,1")
    bench.wait(moment)
    assert bench.do("ASS") == ["ASS", "UPD"]
    place, outputs = bench.motor("Z").at, bench.robot.outputs[1]
    bench.wait(5.0)
    assert (bench.motor("Z").at, bench.robot.outputs[1]) == (place, outputs)
    assert (outputs == 0) == (moment < 0.9)
    assert bench.ask("ERR") == ["ERR E00"]


@pytest.mark.parametrize("moment", [0.1, 0.6, 1.2])
def test_an_immediate_stop_ends_it_with_an_error(bench: Bench, moment: float) -> None:
    bench.ask("UPD 60,1")
    bench.wait(moment)
    assert sorted(bench.ask("AES")) == ["AES", "UPD 001"]
    assert bench.finish() == []
    assert bench.ask("UPD 60") == ["UPD E02"]


def test_a_step_that_fails_ends_it_with_a_message_error(bench: Bench) -> None:
    bench.home()
    assert bench.do("UPD 500") == ["UPD 207"]
    assert bench.ask("ERD") == ["ERD -2070070001"]


def test_the_built_in_macros_pick_and_place() -> None:
    bench = Bench()
    bench.home()
    assert bench.do("PCK 120,130,-20") == ["PCK"]
    assert bench.ask("APS") == ["APS 120.00,130.00,0.00"]
    assert bench.ask("IDO 1") == ["IDO 01"]
    assert bench.do("PLC 130,120,-20") == ["PLC"]
    assert bench.ask("IDO 1") == ["IDO 00"]
    bench.asked("POF 1", "POS 100,100,5", "POS 110,90", "POF 2")
    assert bench.do("CYC 1,2,7") == ["CYC"]
    assert bench.ask("APS") == ["APS 110.00,90.00,5.00"]
    assert bench.robot.variables[1] == 7


def test_the_built_in_ones_can_be_read_from_a_file(tmp_path: Path) -> None:
    lines = [
        f"[macros.{name}]\nprogram = {macro.program}\nsteps = {list(macro.steps)}\n"
        for name, macro in MACROS.items()
    ]
    (tmp_path / "macros.toml").write_text("\n".join(lines))
    assert read_macros(tmp_path / "macros.toml") == dict(MACROS)


def test_a_file_is_read(tmp_path: Path) -> None:
    (tmp_path / "macros.toml").write_text(MACROS_TOML)
    assert read_macros(tmp_path / "macros.toml")["2ND"] == Macro(8, ("POM $1",))


@pytest.mark.parametrize(
    ("text", "complaint"),
    [
        ("", r"has no table \[macros.NAME\]"),
        ("macros = 5", r"has no table \[macros.NAME\]"),
        ("[macros]", r"has no table \[macros.NAME\]"),
        ("[macros.UPD", "is no TOML file: Expected"),
        ("[macros.UP]\nprogram = 1\nsteps = []", "macro 'UP': the name must be three capitals"),
        ("[macros.LMA]\nprogram = 1\nsteps = ['LMI 1']", "macro 'LMA': the name must be .* no command's"),
        ("[macros.POE]\nprogram = 1\nsteps = ['LMI 1']", "macro 'POE'"),
        ("[macros]\nUPD = 3", "macro UPD: give program = 1-999 and steps"),
        ("[macros.UPD]\nsteps = ['LMI 1']", "macro UPD: give program"),
        ("[macros.UPD]\nprogram = 0\nsteps = ['LMI 1']", "macro UPD: give program"),
        ("[macros.UPD]\nprogram = true\nsteps = ['LMI 1']", "macro UPD: give program"),
        ("[macros.UPD]\nprogram = 1\nsteps = []", "macro UPD: give program"),
        ("[macros.UPD]\nprogram = 1\nsteps = [1]", "macro UPD: give program"),
        ("[macros.UPD]\nprogram = 1\nsteps = ['LMI 1']\nspeed = 3", "and nothing else"),
        (
            "[macros.UPD]\nprogram = 1\nsteps = ['LMI 1', 'LMX 1']",
            "macro UPD, step 2, 'LMX 1': a macro can only",
        ),
        ("[macros.UPD]\nprogram = 1\nsteps = ['ORG']", "step 1, 'ORG': a macro can only"),
        ("[macros.UPD]\nprogram = 1\nsteps = ['WAIT soon']", "step 1, 'WAIT soon'"),
        ("[macros.UPD]\nprogram = 1\nsteps = ['LMA $5']", "step 1, 'LMA \\$5'"),
        ("[macros.UPD]\nprogram = 1\nsteps = ['POM 2000']", "from 1 to 1999"),
    ],
)
def test_a_wrong_file_is_told_in_a_sentence(tmp_path: Path, text: str, complaint: str) -> None:
    path = tmp_path / "macros.toml"
    path.write_text(text)
    with pytest.raises(ValueError, match=complaint):
        read_macros(path)


def test_a_file_that_cannot_be_read_is_told_in_a_sentence(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match=r"none\.toml cannot be read: No such file"):
        read_macros(tmp_path / "none.toml")
    (tmp_path / "binary.toml").write_bytes(b"\xff\xfe")
    with pytest.raises(ValueError, match=r"binary\.toml is no TOML file"):
        read_macros(tmp_path / "binary.toml")
