"""The configuration of a plant process."""

from pathlib import Path

import pytest

from fleet.settings import load_plant
from gateway.core.toml_files import ConfigError

GOOD = '[plant]\nservers = ["tls://nats1.example:4222"]\n'
OPEN_TO_ALL = '[access]\nmode = "open"\n[server]\nhost = "10.0.0.1"\ntls_certificate = "a"\ntls_key = "b"\n'


def loaded(folder: Path, text: str) -> object:
    (folder / "plant.toml").write_text(text)
    return load_plant(folder / "plant.toml")


@pytest.mark.parametrize(
    "more", ["", "replicas = 3\n", '[plant.gateways]\nstocker1 = "https://stocker1:8420"\n']
)
def test_good_ones_are_taken(tmp_path: Path, more: str) -> None:
    assert loaded(tmp_path, GOOD + more)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "plant: is required"),
        ("[plant]\nservers = []\n", "plant.servers"),
        ('[plant]\nservers = ["http://x"]\n', "must be a server such as nats://127.0.0.1:4222"),
        (f"{GOOD}replicas = 2\n", "2 replicas are no safer than 1"),
        (f'{GOOD}[plant.gateways]\nstocker1 = "http://stocker1:8420"\n', "must be an address such as https://"),
        (f"{OPEN_TO_ALL}{GOOD}", "open is only"),
        (f"{GOOD}name = 1\n", "unknown key"),
    ],
)  # fmt: skip
def test_a_fault_is_told_with_its_place(tmp_path: Path, text: str, said: str) -> None:
    with pytest.raises(ConfigError, match=r"plant\.toml:") as refused:
        loaded(tmp_path, text)
    assert said in str(refused.value)
