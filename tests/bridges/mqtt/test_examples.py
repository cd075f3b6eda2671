"""The examples of docs/mqtt.md, run as they stand against the demo, with the file that comes with them."""

import os
import re
import shutil
import subprocess
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.bridges.mqtt.stand import Bridge, Broker, free_port
from tests.e2e.processes import Program, data_directory

PAGE = Path(__file__).parents[3] / "docs" / "mqtt.md"
FILE = Path(__file__).parents[3] / "examples" / "bridge.toml"
EXAMPLES = re.findall(r"```sh\n(.*?)```", PAGE.read_text("utf-8").partition("## Ten examples")[2], re.DOTALL)
TOOLS = ("mosquitto_pub", "mosquitto_sub", "mosquitto_rr")


@pytest.fixture(scope="module")
def shell(tmp_path_factory: pytest.TempPathFactory) -> Iterator[dict[str, str]]:
    """The environment of a shell in which the broker's tools speak to the test's broker."""
    folder = tmp_path_factory.mktemp("demo")
    if not all(map(shutil.which, TOOLS)):
        pytest.skip("mosquitto-clients is not installed: make peers installs it")
    broker, port = Broker(folder), free_port()
    demo = Program(
        folder / "demo.log", "serve", "--demo", "--port", str(port), "--data", str(data_directory(folder))
    )
    demo.said("running on")
    config = folder / "bridge.toml"
    text = FILE.read_text("utf-8").replace("127.0.0.1:9464", "127.0.0.1:0")
    config.write_text(text.replace(":8420", f":{port}").replace(":1883", f":{broker.port}"), "utf-8")
    bridge = Bridge(folder, config).start().wait_until_online()
    for tool in TOOLS:
        shim = folder / tool
        shim.write_text(f'#!/bin/sh\nexec {shutil.which(tool)} -p {broker.port} "$@"\n')
        shim.chmod(0o755)
    yield {**os.environ, "PATH": f"{folder}:{os.environ['PATH']}"}
    bridge.program.end()
    demo.end()
    broker.kill()


def test_there_are_ten() -> None:
    assert len(EXAMPLES) == 10


@pytest.mark.parametrize(
    "example", EXAMPLES, ids=[f"example-{number}" for number in range(1, len(EXAMPLES) + 1)]
)
def test_an_example_prints_what_the_page_says(example: str, shell: dict[str, str]) -> None:
    told = re.findall(r"#> (.*)", example)
    done = subprocess.run(  # noqa: S603  # a page of our own
        ["/bin/sh", "-c", example], env=shell, capture_output=True, text=True, timeout=90, check=False
    )
    assert done.returncode == 0, done.stderr
    assert told
    for part in told:
        assert part in done.stdout, done.stdout + done.stderr
