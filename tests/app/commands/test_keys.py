"""The commands for keys, as scripts use them, and the key that other commands send."""

import re
from pathlib import Path

import httpx
import pytest
from typer.testing import CliRunner, Result

from app import cli, http
from app.commands.keys import seconds_of
from app.data_directory import data_directory
from gateway.access.keys import KeyFault, KeyPolicy, KeyStore


def run(*words: str | Path) -> Result:
    return CliRunner().invoke(cli.app, [str(word) for word in words])


def created(data: Path, *words: str) -> str:
    said = run("keys", "create", *words, "--data", data)
    assert said.exit_code == 0, said.stderr
    return said.stdout


def test_a_key_is_printed_alone(tmp_path: Path) -> None:
    out = created(tmp_path, "mes", "--role", "operator", "--scope", "line1, r1", "--expires", "90d")
    assert re.fullmatch(r"mg_[0-9a-f]{12}_[\w-]{43}\n", out)
    key = KeyStore(tmp_path).verify(out.strip())
    assert key is not None
    assert (key.role.value, key.scope) == ("operator", ("line1", "r1"))
    assert key.expires is not None
    assert round(key.expires - key.created) == 90 * 86_400


def test_keys_are_listed_without_what_is_secret(tmp_path: Path) -> None:
    token = created(tmp_path, "mes", "--role", "operator", "--scope", "line1").strip()
    created(tmp_path, "boss", "--role", "admin")
    assert run("keys", "revoke", "boss", "--data", tmp_path).exit_code == 0
    said = run("keys", "list", "--data", tmp_path)
    assert token.split("_", 2)[2] not in said.stdout
    head, *rows = (line.split() for line in said.stdout.splitlines())
    assert head[:5] == ["NAME", "ROLE", "SCOPE", "BEGINS", "STATE"]
    assert [row[:3] + row[4:5] for row in rows] == [
        ["mes", "operator", "line1", "good"],
        ["boss", "admin", "all", "revoked"],
    ]


@pytest.mark.parametrize(
    ("words", "sentence", "code"),
    [
        (("create", "a b", "--role", "viewer"), "no name of a key", 2),
        (("create", "a", "--role", "viewer", "--scope", "line 1"), "no address", 2),
        (("create", "a", "--role", "viewer", "--scope", ""), "no address", 2),
        (("create", "a", "--role", "viewer", "--expires", "9w"), "no time", 2),
        (("create", "a", "--role", "viewer", "--expires", "999999999d"), "within 10 years", 2),
        (("create", "mes", "--role", "viewer"), "a good key mes already", 1),
        (("revoke", "nobody"), "no good key nobody", 1),
    ],
)
def test_what_cannot_be_done_is_told_in_a_sentence(
    words: tuple[str, ...], sentence: str, code: int, tmp_path: Path
) -> None:
    created(tmp_path, "mes", "--role", "viewer")
    said = run("keys", *words, "--data", tmp_path)
    assert (said.exit_code, said.stdout) == (code, "")
    assert sentence in said.stderr
    assert run("keys", "create", "a", "--role", "king", "--data", tmp_path).exit_code == 2


def test_a_key_ends_after_a_year_unless_another_time_is_said(tmp_path: Path) -> None:
    for words, days in (((), 365), (("--expires", "10d"), 10), (("--expires", "never"), None)):
        made = created(tmp_path, f"k{days}", "--role", "viewer", *words).strip()
        key = KeyStore(tmp_path).verify(made)
        assert key is not None
        assert (key.expires and round((key.expires - key.created) / 86_400)) == days
    KeyStore(tmp_path).adopt(KeyPolicy(lifetime_s=None))
    key = KeyStore(tmp_path).verify(created(tmp_path, "configured", "--role", "viewer").strip())
    assert key is not None
    assert key.expires is None


def test_a_key_is_rotated_and_the_list_warns_of_its_end(tmp_path: Path) -> None:
    old = created(tmp_path, "mes", "--role", "operator", "--expires", "20d").strip()
    assert "warning: mes ends at" in run("keys", "list", "--data", tmp_path).stderr
    said = run("keys", "rotate", "mes", "--overlap", "12h", "--data", tmp_path)
    assert re.fullmatch(r"mg_[0-9a-f]{12}_[\w-]{43}\n", said.stdout), said.stderr
    ends = {key.prefix: key.expires for key in KeyStore(tmp_path).all()}
    assert (ends[old[3:15]] or 0) < min(
        expires or 0 for prefix, expires in ends.items() if prefix != old[3:15]
    )
    assert KeyStore(tmp_path).verify(old) is not None
    assert run("keys", "rotate", "mes", "--overlap", "0s", "--data", tmp_path).exit_code == 0
    assert KeyStore(tmp_path).verify(old) is None
    assert run("keys", "rotate", "nobody", "--data", tmp_path).exit_code == 1


def test_a_directory_that_is_not_there_is_told_and_not_made(tmp_path: Path) -> None:
    mistyped = tmp_path / "dta"
    for words in (["list"], ["revoke", "mes"]):
        said = run("keys", *words, "--data", mistyped)
        assert (said.exit_code, said.stderr) == (1, f"There is no directory {mistyped}, so it has no keys.\n")
    assert not mistyped.exists()


@pytest.mark.parametrize(
    ("text", "seconds"), [("30s", 30), ("10m", 600), ("12h", 43_200), ("90d", 7_776_000)]
)
def test_times(text: str, seconds: float) -> None:
    assert seconds_of(text) == seconds


@pytest.mark.parametrize("text", ["", "5", "d", "-1d", "1.5h", "1w", "5 d", "0s", "٣d", "1d "])
def test_what_is_no_time(text: str) -> None:
    with pytest.raises(KeyFault, match="no time"):
        seconds_of(text)


def test_commands_send_the_key(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    sent: list[str] = []

    def request(*_: object, headers: dict[str, str], **__: object) -> httpx.Response:
        sent.append(headers.get("Authorization", ""))
        return httpx.Response(200, json={"pulses": 0, "status": "succeeded", "found": []})

    monkeypatch.setattr(http, "request", request)
    file = tmp_path / "key"
    file.write_text("secret")
    assert run("send", "3F", "6PD", "--key-file", file).exit_code == 0
    assert run("scan", "line1", "--key-file", file).exit_code == 0
    assert run("send", "3F", "6PD", "--key-file", tmp_path / "nowhere").exit_code == 2
    monkeypatch.setenv("MOTION_GATEWAY_KEY_FILE", str(file))
    assert run("send", "3F", "6PD").exit_code == 0
    assert sent == ["Bearer secret"] * 3


def test_the_usual_data_directory(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("os.geteuid", lambda: 0)
    assert data_directory() == Path("/var/lib/motion-gateway")
    monkeypatch.setattr("os.geteuid", lambda: 1000)
    monkeypatch.setenv("HOME", "/home/hanako")
    for given in ("", "relative"):
        monkeypatch.setenv("XDG_STATE_HOME", given)
        assert data_directory() == Path("/home/hanako/.local/state/motion-gateway")
    monkeypatch.setenv("XDG_STATE_HOME", "/state")
    assert data_directory() == Path("/state/motion-gateway")
