"""The file of the configuration: compared with what is served, and written to without losing a comment."""

from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from gateway.config import parse
from gateway.config_file import Changes, ConfigFile, LineChange, changes
from gateway.core.errors import NotSent
from gateway.core.toml_files import ConfigError

HEAD = """\
# The plant of hall 3.
[server]
port = 8420  # as agreed

"""
ARM = """\
[[lines]]
id = "arm"
address = "tcp://127.0.0.1:1"   # the left one
"""
LEG = """\
# An RC-400 below.
[[lines]]
id = "leg"
address = "tcp://127.0.0.1:2"
"""
TABLES = """
[[lines.bodies]]
id = "00"
# name = "lift"

[[lines.bodies]]
id = "3F"

[[lines.groups]]
id = "80"
members = ["00", "3F"]
"""


def changed(before: str, after: str) -> Changes:
    return changes(parse(before, "before"), parse(after, "after"))


# what differs


def test_what_is_the_same_is_not_told() -> None:
    assert changed(HEAD + ARM, ARM + "# another comment") == Changes(lines=[], needs_restart=[])


def test_each_line_is_added_removed_or_changed_by_its_keys() -> None:
    before = ARM + TABLES + LEG
    after = (
        ARM + 'reply_timeout_s = 0.7\nbodies = [{ id = "00" }, { id = "3F", name = "lift" }, { id = "40" }]\n'
    )
    cell = LEG.replace("leg", "toe")
    assert changed(before, after + cell).lines == [
        LineChange(line_id="leg", change="removed", keys=[]),
        LineChange(
            line_id="arm", change="changed", keys=["reply_timeout_s", "bodies.3F", "bodies.40", "groups.80"]
        ),
        LineChange(line_id="toe", change="added", keys=[]),
    ]


def test_what_takes_a_restart_is_named() -> None:
    after = '[server]\nport = 9000\n[access]\nmode = "open"\n' + ARM
    assert changed(HEAD + ARM, after).needs_restart == ["server.port", "access.mode"]


# adding


def file(folder: Path, text: str) -> ConfigFile:
    path = folder / "gateway.toml"
    path.write_text(text)
    path.chmod(0o640)
    return ConfigFile(path)


@pytest.mark.parametrize(
    "bodies",
    [
        "",
        TABLES,
        'bodies = [{ id = "00" }]',
        'bodies = [\n    { id = "00" },  # the first ]\n    { id = "01" }  # no comma\n]  # all',
        'bodies = [\n    { id = "00", name = "a [\\"b] # c" },\n]\npoll_interval_s = 0.1',
        "bodies = []",
    ],
)
@pytest.mark.parametrize(
    ("before", "after"), [("", ""), (HEAD, LEG), (HEAD + LEG, '[access]\nmode = "keys"\n')]
)
def test_bodies_are_added_to_their_line_and_all_else_stays(
    tmp_path: Path, before: str, bodies: str, after: str
) -> None:
    given = before + ARM + bodies + "\n" + after
    it = file(tmp_path, given)
    text, config = it.with_bodies("arm", [{"id": "70", "name": "grip [1]"}, {"id": "71"}])
    told = changes(parse(given, "given"), config)
    assert told.lines == [LineChange(line_id="arm", change="changed", keys=["bodies.70", "bodies.71"])]
    assert told.needs_restart == []
    assert [row for row in given.split() if row not in (*text.split(), "[]")] == []
    assert text.count("#") == given.count("#")
    it.write(text)
    assert it.load() == config
    assert it.path.stat().st_mode & 0o777 == 0o640
    assert list(tmp_path.iterdir()) == [it.path]


def test_a_line_is_added_with_its_robot(tmp_path: Path) -> None:
    it = file(tmp_path, HEAD + ARM)
    robot = {"id": "r1", "units": [{"number": 1, "axes": ["X", "Y"]}]}
    table = {"id": "cell", "protocol": "fics", "address": "tcp://127.0.0.1:9", "reply_timeout_s": 0.4}
    text, config = it.with_line({**table, "robot": robot})
    assert text.startswith(HEAD + ARM)
    assert changes(it.load(), config).lines == [LineChange(line_id="cell", change="added", keys=[])]


@pytest.mark.parametrize(
    "bodies", ["", TABLES, 'bodies = [{ id = "00" }]', 'bodies = [\n    { id = "00" },\n]']
)
def test_a_comment_stands_above_what_is_added(tmp_path: Path, bodies: str) -> None:
    comment = 'Found.\x07\nbodies = "none"\r\n[access]'
    written = '# Found.\n# bodies = "none"\n# [access]\n'
    it = file(tmp_path, ARM + bodies + "\n" + LEG)
    text, config = it.with_bodies("arm", [{"id": "70"}, {"id": "71"}], comment)
    beneath = "bodies = " if "bodies = " in bodies else '[[lines.bodies]]\nid = "70"'
    assert written + beneath in text
    assert parse(text, "again") == config == it.with_bodies("arm", [{"id": "70"}, {"id": "71"}])[1]
    text, _ = it.with_line({"id": "toe", "address": "tcp://127.0.0.1:9"}, comment)
    assert "\n\n" + written + '[[lines]]\nid = "toe"' in text


@pytest.mark.parametrize(
    ("body", "words"),
    [({"id": "00"}, "is the same as"), ({"id": "99"}, "99"), ({"id": "40", "nam": 1}, "unknown key")],
)
def test_what_would_be_no_configuration_is_refused(tmp_path: Path, body: dict[str, Any], words: str) -> None:
    it = file(tmp_path, ARM + TABLES)
    with pytest.raises(ConfigError, match=words):
        it.with_bodies("arm", [body])


@pytest.mark.parametrize("text", ['lines = [{ id = "arm", address = "tcp://127.0.0.1:1" }]', ARM])
def test_a_form_that_is_not_understood_is_left_to_people(tmp_path: Path, text: str) -> None:
    with pytest.raises(ConfigError, match="by hand"):
        file(tmp_path, text).with_bodies("arm" if text != ARM else "leg", [{"id": "00"}])


def test_a_file_that_cannot_be_written_stays(tmp_path: Path) -> None:
    it = ConfigFile(tmp_path / "none" / "gateway.toml")
    with pytest.raises(NotSent, match="cannot be written"):
        it.write(ARM)


def test_the_port_of_the_command_line_counts(tmp_path: Path) -> None:
    path = file(tmp_path, HEAD + ARM).path
    assert ConfigFile(path, port=0).load().server.port == 0


@given(st.text(min_size=1, max_size=64).filter(str.isprintable).filter(str.strip))
def test_any_name_can_be_written(name: str) -> None:
    with TemporaryDirectory() as folder:
        text, config = file(Path(folder), ARM).with_bodies("arm", [{"id": "40", "name": name}])
    assert config == parse(text, "again")
    assert config.lines[0].bodies[0].name == name  # type: ignore[attr-defined]
