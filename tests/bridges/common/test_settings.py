"""The file of a bridge: every fault has its line, and no secret stands in it."""

from pathlib import Path

import pytest

from bridges.common.settings import BridgeFile
from gateway.core.toml_files import ConfigError, parse


def read(text: str) -> BridgeFile:
    return parse(text, "bridge.toml", BridgeFile)


GOOD = '[gateway]\nurl = "http://127.0.0.1:8420/"\n'


def test_little_has_to_be_said() -> None:
    file = read(GOOD)
    assert (file.gateway.url, file.gateway.name, file.bridge.listen) == (
        "http://127.0.0.1:8420",
        "gateway",
        None,
    )


@pytest.mark.parametrize(
    ("text", "faults"),
    [
        ("", ["1: gateway: is required"]),
        ("[gateway]\nurl = 5\n", ["2: gateway.url: must be text in quotes"]),
        ('[gateway]\nurl = "mqtt://x"\n', ["2: gateway.url: must be an address such as http://"]),
        (
            '[gateway]\nurl = "http://me:secret@x"\n',
            ["2: gateway.url: must be an address alone: user names and secrets have keys of their own"],
        ),
        (GOOD + 'nmae = "x"\n', ["3: gateway.nmae: is not known here"]),
        (GOOD + 'name = "a/b"\n', ["3: gateway.name: must be a name of letters"]),
        (GOOD + 'key_file = "/nowhere"\n', ["3: gateway.key_file: cannot be read: No such file"]),
        (GOOD + '[bridge]\nlisten = "9464"\n', ["4: bridge.listen: must be an address and a port"]),
        (GOOD + "[callers.mes]\nkey = 5\n", ["4: callers.mes.key: is not known here"]),
        (GOOD + "[callers", ["3: not valid TOML"]),
    ],
)
def test_faults_have_their_lines(text: str, faults: list[str]) -> None:
    with pytest.raises(ConfigError) as raised:
        read(text)
    told = str(raised.value).splitlines()
    assert len(told) == len(faults)
    for line, fault in zip(told, faults, strict=True):
        assert line.startswith(f"bridge.toml:{fault}"), line
        assert "secret@" not in line


@pytest.mark.parametrize("content", [b"", b"\n", b"two\nlines\n", b"\xff\xfe", b"a\0b"])
def test_a_file_without_a_key_is_a_fault_that_does_not_show_it(tmp_path: Path, content: bytes) -> None:
    (tmp_path / "key").write_bytes(content)
    with pytest.raises(ConfigError) as raised:
        read(f'{GOOD}[callers.mes]\nkey_file = "{tmp_path / "key"}"\n')
    assert "bridge.toml:4: callers.mes.key_file: holds no" in str(raised.value)
    assert "two" not in str(raised.value)
