"""The configuration over HTTP: read again, and written to."""

import asyncio
from pathlib import Path
from tempfile import TemporaryDirectory

from gateway.config_file import ConfigFile
from tests.api.stand import BODIES, Stand, on_stand

TEXT = """
[access]
mode = "open"

[[lines]]
id = "arm"
address = "tcp://127.0.0.1:1"
bodies = [
    { id = "00" },
    { id = "01", units = { unit = "mm", pulses_per_unit = 1000.0 } },
    { id = "3F" },  # the lift
]
"""


def give_file(stand: Stand, folder: str) -> Path:
    path = Path(folder) / "gateway.toml"
    path.write_text(TEXT)
    stand.plant.file = ConfigFile(path)
    assert stand.plant.file.load() == stand.plant.config
    return path


@on_stand({"arm": BODIES})
async def test_it_is_read_again(stand: Stand) -> None:
    with TemporaryDirectory() as folder:
        path = give_file(stand, folder)
        nothing = {"lines": [], "needs_restart": [], "applied": False, "busy": []}
        assert (await stand.post("/system/reload", {"dry_run": True})).json() == nothing
        assert (await stand.post("/system/reload")).json() == nothing | {"applied": True}
        path.write_text("[server]\nraw_commands = true\n" + TEXT + "trace_file = 1")
        answer = await stand.post("/system/reload")
        assert answer.status_code == 422
        assert "gateway.toml:" in answer.json()["detail"]
        assert "lines[0].trace_file: must be a path in quotes, not 1; nothing was" in answer.json()["detail"]
        path.write_text("[server]\nraw_commands = true\n" + TEXT)
        told = (await stand.post("/system/reload", {"dry_run": True})).json()
        assert told["needs_restart"] == ["server.raw_commands"]


@on_stand({"arm": BODIES})
async def test_bodies_and_lines_are_added_and_stand_in_the_file(stand: Stand) -> None:
    with TemporaryDirectory() as folder:
        path = give_file(stand, folder)
        wanted = {"bodies": [{"id": "40", "name": "grip"}], "dry_run": True}
        told = (await stand.post("/lines/arm/bodies", wanted)).json()
        assert told == {
            "lines": [{"line_id": "arm", "change": "changed", "keys": ["bodies.40"]}],
            "needs_restart": [],
            "applied": False,
            "busy": [],
        }
        assert path.read_text() == TEXT
        added = (await stand.post("/lines/arm/bodies", wanted | {"dry_run": False})).json()
        assert added == told | {"applied": True}
        assert '{ id = "3F" }, { id = "40", name = "grip" }  # the lift' in path.read_text()
        assert "arm.40" in [it["body_id"] for it in (await stand.get("/bodies")).json()["bodies"]]
        line = {"id": "arm", "address": "tcp://127.0.0.1:9"}
        for wrong in (line, {"id": "leg"}, line | {"id": None}, {}):
            assert (await stand.post("/lines", {"line": wrong})).status_code == 422, wrong
        for field in ({"trace_file": "/etc/cron.d/x"}, {"address": f"dpram://{path}", "protocol": "fics"}):
            robot = {"id": "r9", "units": [{"number": 1, "axes": ["X"]}]}
            answer = await stand.post("/lines", {"line": line | {"id": "leg", "robot": robot} | field})
            assert answer.status_code == 422
            assert answer.json()["detail"].endswith(("nothing was changed.", "nothing was sent."))
        assert "leg" not in path.read_text(), "no request names a file that is written"
        assert (await stand.post("/lines/leg/bodies", wanted)).status_code == 404
        assert (await stand.post("/lines/arm/bodies", {"bodies": []})).status_code == 422


@on_stand({"arm": BODIES})
async def test_of_changes_that_come_together_none_is_lost(stand: Stand) -> None:
    numbers = ("40", "41", "42")
    with TemporaryDirectory() as folder:
        path = give_file(stand, folder)
        adding = (stand.post("/lines/arm/bodies", {"bodies": [{"id": it}]}) for it in numbers)
        added = await asyncio.gather(*adding, stand.post("/system/reload"))
        assert [it.status_code for it in added] == [200] * 4, [it.text for it in added]
        told = sorted(key for it in added for line in it.json()["lines"] for key in line["keys"])
        assert told == [f"bodies.{it}" for it in numbers], "each of its own"
        served = [it["body_id"] for it in (await stand.get("/bodies")).json()["bodies"]]
        for number in numbers:
            assert f"arm.{number}" in served
            assert f'id = "{number}"' in path.read_text()


@on_stand()
async def test_a_gateway_without_a_file_says_so(stand: Stand) -> None:
    for path, content in (
        ("/system/reload", None),
        ("/lines", {"line": {"id": "leg"}}),
        ("/lines/arm/bodies", {"bodies": [{"id": "40"}]}),
    ):
        answer = await stand.post(path, content)
        assert (answer.status_code, answer.json()["type"].rpartition(":")[2]) == (403, "not-allowed")
