import json
import re
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import BaseModel, ValidationError

from gateway.config import AccessTable, Oidc, Server, load, parse
from gateway.core import tables
from gateway.core.toml_files import ConfigError
from gateway.families import FAMILIES
from gateway.fics import config as fics
from gateway.fics.config import RobotTable, UnitTable
from gateway.membership import PlantOfGateways
from gateway.rorze.config import BodyTable, GroupTable, RorzeLineTable

PLANT = """\
[server]
port = 9000
allowed_hosts = ["Gateway.Example"]
allowed_origins = ["http://panel.example:8080"]

[[lines]]
id = "main"
address = "serial:///dev/ttyUSB0?baud=38400"
trace_file = "/var/log/main.jsonl"

[[lines.bodies]]
id = "00"

[[lines.bodies]]
id = "3f"
name = "旋回"
units = { unit = "mm", pulses_per_unit = 100 }

[[lines.groups]]
id = "8a"
members = ["3F", "00"]

[[lines]]
id = "aux"
address = "tcp://127.0.0.1:4001"
stop_mode = "after_reply"
"""


def complaint(text: str) -> str:
    with pytest.raises(ConfigError) as refused:
        parse(text, "gateway.toml")
    return str(refused.value)


def changed(old: str, new: str) -> str:
    assert PLANT.count(old) == 1, "the test means one place"
    return PLANT.replace(old, new)


def lines_of_bodies(text: str) -> list[RorzeLineTable]:
    return [line for line in parse(text, "x").lines if isinstance(line, RorzeLineTable)]


def test_a_plant_is_read_with_its_defaults() -> None:
    config = parse(PLANT, "gateway.toml")
    main, aux = lines_of_bodies(PLANT)
    assert (config.server.host, config.server.port) == ("127.0.0.1", 9000)
    assert not config.server.raw_commands
    assert not config.server.allow_endless_moves
    assert (main.introducer, main.reply_timeout_s, main.late_reply_s, main.pipeline) == ("&", 0.5, 2.0, 1)
    assert (main.stop_mode, aux.stop_mode) == ("interject", "after_reply")
    assert main.trace_file == Path("/var/log/main.jsonl")
    assert (aux.bodies, aux.groups, aux.trace_file) == ((), (), None)


def test_addresses_become_canonical_and_numbers() -> None:
    config = parse(PLANT, "gateway.toml")
    bodies, (group,) = lines_of_bodies(PLANT)[0].bodies, lines_of_bodies(PLANT)[0].groups
    assert [(body.id, body.number) for body in bodies] == [("00", 0x00), ("3F", 0x3F)]
    assert (group.id, group.number) == ("8A", 0x8A)
    assert config.server.allowed_hosts == ("gateway.example",)


def test_a_group_keeps_the_order_it_was_written_in() -> None:
    assert lines_of_bodies(PLANT)[0].groups[0].members == ("3F", "00")


def test_units_and_names_are_optional() -> None:
    first, second = lines_of_bodies(PLANT)[0].bodies
    assert (first.name, first.units) == (None, None)
    assert second.name == "旋回"
    assert second.units is not None
    assert (second.units.unit, second.units.pulses_per_unit) == ("mm", 100.0)
    assert (second.units.pulses(1.5, "mm"), second.position_tolerance) == (150, 0)


def test_a_configuration_cannot_be_changed() -> None:
    config = parse(PLANT, "gateway.toml")
    with pytest.raises(ValidationError, match="frozen"):
        config.server.port = 1  # type: ignore[misc]  # what the test forbids


def test_inputs_and_outputs_have_names() -> None:
    named = 'name = "旋回"\ninputs = { 0 = "door", 9 = "index" }\noutputs = { 15 = "lamp" }'
    body = lines_of_bodies(changed('name = "旋回"', named))[0].bodies[1]
    assert (body.input_names, body.output_names) == ({0: "door", 9: "index"}, {15: "lamp"})
    absent = 'name = "旋回"\ninputs = { 10 = "door" }'
    said = complaint(changed('name = "旋回"', absent))
    assert said == "gateway.toml:17: lines[0].bodies[1].inputs.10: must be from 0 to 9, not '10'"


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("port = 9000", "prot = 9000", "2: server.prot: unknown key (did you mean port?)"),
        (
            "stop_mode =",
            "stopp_mode =",
            "26: lines[1].stopp_mode: unknown key (did you mean stop_mode?)",
        ),
        (
            "pulses_per_unit",
            "pulses_by_unit",
            "17: lines[0].bodies[1].units.pulses_by_unit: unknown key (did you mean pulses_per_unit?)",
        ),
        ("[server]", "[sever]", "1: sever: unknown key (did you mean server?)"),
        (
            'name = "旋回"',
            "zzz = 1",
            "16: lines[0].bodies[1].zzz: unknown key (known are id, name, units, inputs, outputs, "
            "position_tolerance, in_position, power_comment, events, slow_pattern, needs_origin, "
            "silence_needs_acknowledgement)",
        ),
    ],
)
def test_an_unknown_key_is_refused_with_its_line_and_a_guess(old: str, new: str, said: str) -> None:
    assert complaint(changed(old, new)) == f"gateway.toml:{said}"


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("9000", "true", "2: server.port: must be a whole number, not true"),
        ("9000", "70000", "2: server.port: must be 65535 or less, not 70000"),
        ("9000", '"9000"', "2: server.port: must be a whole number, not '9000'"),
        ('id = "00"', "id = 0", "12: lines[0].bodies[0].id: must be text in quotes, not 0"),
        (
            'id = "00"',
            'id = "78"',
            "12: lines[0].bodies[0].id: must be two hex digits from 00 to 77, not '78'",
        ),
        (
            'id = "00"',
            'id = "٠٠"',
            "12: lines[0].bodies[0].id: must be two hex digits from 00 to 77, not '٠٠'",
        ),
        ('"8a"', '"9F"', "20: lines[0].groups[0].id: must be two hex digits from 80 to 9E, not '9F'"),
        (
            'name = "旋回"',
            "position_tolerance = -1",
            "16: lines[0].bodies[1].position_tolerance: must be 0 or more, not -1",
        ),
        (
            'name = "旋回"',
            "position_tolerance = 0.5",
            "16: lines[0].bodies[1].position_tolerance: must be a whole number, not 0.5",
        ),
        ("= 100 }", "= 0 }", "17: lines[0].bodies[1].units.pulses_per_unit: must be greater than 0, not 0"),
        (
            "= 100 }",
            "= nan }",
            "17: lines[0].bodies[1].units.pulses_per_unit: must be a finite number, not nan",
        ),
        (
            "after_reply",
            "never",
            "26: lines[1].stop_mode: must be 'interject' or 'after_reply', not 'never'",
        ),
        ('address = "tcp://127.0.0.1:4001"\n', "", "23: lines[1].address: is required"),
        ("[[lines.groups]]", "[lines.groups]", "19: lines[0].groups: must be an array"),
        ('["3F", "00"]', '"3F,00"', "21: lines[0].groups[0].members: must be an array, not '3F,00'"),
        ('"旋回"', '"a\\u0007"', "16: lines[0].bodies[1].name: must be printable text"),
        ('"/var/log/main.jsonl"', "5", "9: lines[0].trace_file: must be a path in quotes, not 5"),
        (
            'name = "旋回"',
            'inputs = ["door"]',
            "16: lines[0].bodies[1].inputs: must be a table",
        ),
        (
            'stop_mode = "after_reply"',
            'protocol = ["fics"]',
            "26: lines[1].protocol: must be 'rorze' or 'fics', not ['fics']",
        ),
    ],
)
def test_a_wrong_value_is_refused_with_its_line_and_what_is_expected(old: str, new: str, said: str) -> None:
    assert complaint(changed(old, new)) == f"gateway.toml:{said}"


@pytest.mark.parametrize(
    ("old", "new", "place", "said"),
    [
        ('"main"', '"Main"', "7: lines[0].id", "lower-case letters"),
        ("serial:///dev", "seriel:///dev", "8: lines[0].address", "serial://, tcp://"),
        ("?baud=38400", "?speed=38400", "8: lines[0].address", "speed"),
        ("port = 9000", 'host = "0.0.0.0"', "2: server.host", "tls_certificate and tls_key"),
        ("port = 9000", 'host = "example.com"', "2: server.host", "an IP address"),
        ("Gateway.Example", "http://gateway", "3: server.allowed_hosts[0]", "without scheme"),
        ("panel.example:8080", "panel.example/x", "4: server.allowed_origins[0]", "must be an origin"),
        ('"after_reply"', '"after_reply"\npipeline = 2', "27: lines[1].pipeline", "must be 1: replies carry"),
    ],
)
def test_a_refusal_gives_its_reason(old: str, new: str, place: str, said: str) -> None:
    sentence = complaint(changed(old, new))
    assert sentence.startswith(f"gateway.toml:{place}: ")
    assert said in sentence


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ('"aux"', '"main"', "24: lines[1].id: is the same as lines[0].id"),
        (
            "tcp://127.0.0.1:4001",
            "serial:///dev/ttyUSB0",
            "25: lines[1].address: is the same as lines[0].address",
        ),
        ('"3f"', '"00"', "15: lines[0].bodies[1].id: is the same as bodies[0].id"),
        ('["3F", "00"]', '["3F", "3f"]', "21: lines[0].groups[0].members[1]: is the same as"),
        ('["3F", "00"]', '["3F", "11"]', "21: lines[0].groups[0].members[1]: 11 is no body of line main"),
        ('["3F", "00"]', '["3F"]', "21: lines[0].groups[0].members: must name at least 2 bodies"),
        (
            'stop_mode = "after_reply"',
            'trace_file = "/var/log/main.jsonl"',
            "26: lines[1].trace_file: two lines cannot write to one file",
        ),
    ],
)
def test_what_contradicts_itself_is_refused(old: str, new: str, said: str) -> None:
    assert complaint(changed(old, new)).startswith(f"gateway.toml:{said}")


def with_group_of(count: int) -> str:
    ids = [f"{number:02X}" for number in range(count)]
    bodies = "".join(f'[[lines.bodies]]\nid = "{body}"\n' for body in ids)
    group = f'[[lines.groups]]\nid = "80"\nmembers = {ids}\n'
    return '[[lines]]\nid = "a"\naddress = "tcp://127.0.0.1:1"\n' + bodies + group


def test_a_group_may_have_as_many_members_as_fit_in_60_characters() -> None:
    assert len(lines_of_bodies(with_group_of(17))[0].groups[0].members) == 17
    assert "members: names too many bodies" in complaint(with_group_of(18))


def test_a_line_with_one_digit_body_numbers_has_neither_higher_bodies_nor_groups() -> None:
    old_form = 'address = "tcp://127.0.0.1:4001"\nintroducer = "$"\n'
    line = f'[[lines]]\nid = "a"\n{old_form}'
    assert lines_of_bodies(line + '[[lines.bodies]]\nid = "0F"\n')[0].bodies[0].number == 15
    assert complaint(line + '[[lines.bodies]]\nid = "10"\n').startswith(
        "gateway.toml:6: lines[0].bodies[0].id"
    )
    groups = '[[lines.bodies]]\nid = "00"\n[[lines.bodies]]\nid = "01"\n[[lines.groups]]\nid = "80"\n'
    assert "cannot be addressed after '$'" in complaint(f'{line}{groups}members = ["00", "01"]\n')


def test_faults_are_told_together_in_the_order_of_the_file() -> None:
    text = changed("port = 9000", "port = -1").replace('"3f"', '"zz"').replace("after_reply", "no")
    told = complaint(text).splitlines()
    assert [re.split(":", line)[1] for line in told] == ["2", "15", "26"]


@pytest.mark.parametrize(
    ("text", "place"),
    [
        ("[server]\nport 5\n", "2"),
        ("[server]\nport = 5\nport = 6\n", "3"),
        ("[server]\nport = ", "2"),
        (f"[server]\nport = {'9' * 5000}\n", "2"),
        (f"[server]\nport = {'[' * 5000}\n", "2"),
    ],
)
def test_a_syntax_error_tells_its_line(text: str, place: str) -> None:
    assert complaint(text).startswith(f"gateway.toml:{place}: not valid TOML: ")


def test_a_plant_without_lines_is_refused() -> None:
    assert complaint("") == "gateway.toml:1: lines: at least one [[lines]] table is required"


def test_a_file_is_read_and_a_missing_or_binary_one_is_a_config_error(tmp_path: Path) -> None:
    file = tmp_path / "gateway.toml"
    with pytest.raises(ConfigError, match=r"gateway\.toml: cannot be read: No such file"):
        load(file)
    file.write_bytes(b"\xff\xfe")
    with pytest.raises(ConfigError, match="it is not UTF-8 text"):
        load(file)
    file.write_text(PLANT, "utf-8")
    assert load(file) == parse(PLANT, "another name")


def faults(text: str) -> list[str]:
    try:
        parse(text, "x")
    except ConfigError as error:
        return re.split(r"\n(?=x:)", str(error))
    return []


@given(st.text() | st.text("[]{}=\"'.,#\nlines server port id 01é"))
def test_any_text_is_a_configuration_or_a_config_error(text: str) -> None:
    assert all(re.match(r"x:\d+: .", fault) for fault in faults(text))


WRONG_OR_RIGHT = ['""', "0", "-1", "1e400", "[]", "{}", "[[]]", "1979-05-27", "false", '"00"']


@pytest.mark.parametrize("key", re.findall(r"(?m)^(\w+) = ", PLANT))
@pytest.mark.parametrize("value", WRONG_OR_RIGHT)
def test_any_value_of_a_key_is_taken_or_refused_on_its_line(key: str, value: str) -> None:
    text = re.sub(rf"(?m)^{key} = .*$", f"{key} = {value}", PLANT, count=1)
    line = text[: text.index(f"{key} = {value}")].count("\n") + 1
    consequences = ("is no body of line", "is the same as")
    assert all(
        f"x:{line}: " in fault or any(word in fault for word in consequences) for fault in faults(text)
    )


REFERENCE = (Path(__file__).parents[2] / "docs/configuration.md").read_text("utf-8")


def test_the_example_in_the_documentation_is_a_configuration() -> None:
    example = re.search(r"```toml\n(.*?)```", REFERENCE, re.DOTALL)
    assert example is not None
    assert [body.name for body in lines_of_bodies(example[1])[0].bodies] == ["swivel", "arm", "lift"]


def test_the_robot_in_the_documentation_is_a_configuration() -> None:
    (robot,) = re.findall(r"```toml\n([^`]*?\[lines\.robot\].*?)```", REFERENCE, re.DOTALL)
    (line,) = parse(robot, "x").lines
    assert isinstance(line, fics.FicsLineTable)
    scara, table = (unit.systems for unit in line.robot.units)
    assert [scara[axis].value for axis in "XYZ@AB"] == ["mm", "mm", "mm", "degree", "degree", "degree"]
    assert {axis: system.value for axis, system in table.items()} == {"X": "pulse", "Y": "pulse"}


@pytest.mark.parametrize(
    ("table", "header"),
    [
        (Server, "[server]"),
        (AccessTable, "[access]"),
        (Oidc, "[access.oidc]"),
        (PlantOfGateways, "[plant]"),
        (tables.LineTable, "[[lines]]"),
        (RorzeLineTable, '[[lines]]` of protocol `"rorze"'),
        (fics.FicsLineTable, '[[lines]]` of protocol `"fics"'),
        (BodyTable, "[[lines.bodies]]"),
        (GroupTable, "[[lines.groups]]"),
        (RobotTable, "[lines.robot]"),
        (UnitTable, "[[lines.robot.units]]"),
    ],
)
def test_the_documentation_has_every_key_with_its_default(table: type[BaseModel], header: str) -> None:
    section = re.search(rf"## `{re.escape(header)}`.*?(?=\n## |\Z)", REFERENCE, re.DOTALL)
    assert section is not None
    written = dict(re.findall(r"(?m)^\| `(\w+)` \| (.+?) \|", section[0]))
    inherited = tables.LineTable.model_fields if table in (RorzeLineTable, fics.FicsLineTable) else ()
    elsewhere = {"bodies", "groups", *inherited}
    fields = {key: field for key, field in table.model_fields.items() if key not in elsewhere}
    assert list(written) == list(fields)
    for key, field in fields.items():
        default = "required" if field.is_required() else shown(field.default)
        if key == "protocol":  # which the registry decides
            default = shown(next(iter(FAMILIES)))
        assert written[key] == default


def shown(default: object) -> str:
    if default is None:
        return "none"
    if isinstance(default, tuple):
        return f"`{json.dumps(default)}`"
    text = f'"{default}"' if isinstance(default, str) else str(default).lower()
    return f"`{text}`"


@pytest.mark.parametrize(
    ("bodies", "sweep_groups", "what"),
    [
        (2, '["90"]', "the first and the last"),
        (2, '["9E", "90"]', "the first and the last"),
        (2, '["80", "90"]', "must leave out 80"),
        (18, '["90", "90"]', "at least 2 numbers"),
    ],
)
def test_sweeps_have_numbers_of_their_own(bodies: int, sweep_groups: str, what: str) -> None:
    tables = ", ".join(f'{{id = "{number:02X}"}}' for number in range(bodies))
    told = complaint(
        '[[lines]]\nid = "main"\naddress = "tcp://127.0.0.1:4001"\n'
        f'bodies = [{tables}]\ngroups = [{{id = "80", members = ["00", "01"]}}]\n'
        f"sweep_groups = {sweep_groups}\n"
    )
    assert what in told


@pytest.mark.parametrize("network", ["0.0.0.0/0", "::/0", "10.0.0.1/8", "proxy.example", ""])
def test_trusted_proxies_are_named(network: str) -> None:
    with pytest.raises(ValidationError, match=r"must (be an IP address|name proxies)"):
        Server(trusted_proxies=(network,))


def test_lines_at_terminal_servers_are_in_the_configured_networks() -> None:
    text = '[server]\nline_networks = ["10.1.0.0/16"]\n[[lines]]\nid = "a"\naddress = "tcp://{}:4001"\n'
    assert parse(text.format("10.1.2.3"), "x.toml").lines
    for host in ("10.2.0.1", "moxa"):
        with pytest.raises(
            ConfigError, match=r"x.toml:5: lines\[0\].address: must be an IP address in server"
        ):
            parse(text.format(host), "x.toml")
