"""The data directory of a gateway: one for each configuration, and an old one is found again."""

from pathlib import Path

import pytest

from app import data_directory
from app.data_directory import data_of, take


@pytest.fixture(autouse=True)
def usual(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The usual place of a machine without a service."""
    monkeypatch.setattr("os.geteuid", lambda: 1000)
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    monkeypatch.setattr(data_directory, "USUAL_CONFIG", tmp_path / "etc.toml")
    return tmp_path / "state" / "motion-gateway"


def config(folder: Path, name: str) -> Path:
    file = folder / name
    file.write_text("")
    return file


def test_two_configurations_of_one_machine_share_nothing(tmp_path: Path, usual: Path) -> None:
    plant, trial = config(tmp_path, "plant.toml"), config(tmp_path, "trial.toml")
    assert data_of(plant) == usual
    take(usual, plant)
    assert data_of(plant) == usual
    other = data_of(trial)
    assert other.parent == usual.parent
    assert other.name.startswith("motion-gateway-trial-")
    take(other, trial)
    (tmp_path / "sub").mkdir()
    assert len({usual, other, data_of(config(tmp_path / "sub", "trial.toml"))}) == 3
    assert data_of(trial) == other


def test_the_data_of_an_earlier_version_are_found_again(tmp_path: Path, usual: Path) -> None:
    usual.mkdir(parents=True)
    (usual / "journal.db").write_text("of an earlier version, which notes no owner")
    assert data_of(config(tmp_path, "gateway.toml")) == usual


def test_the_data_of_the_service_are_not_taken_by_a_trial(tmp_path: Path, usual: Path) -> None:
    service = config(tmp_path, "etc.toml")
    assert data_of(config(tmp_path, "trial.toml")) != usual
    assert data_of(service) == usual


def test_a_configuration_named_by_another_path_is_the_same(
    tmp_path: Path, usual: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    plant = config(tmp_path, "plant.toml")
    take(usual, plant)
    monkeypatch.chdir(tmp_path)
    (tmp_path / "link.toml").symlink_to(plant)
    assert data_of(Path("plant.toml")) == data_of(tmp_path / "link.toml") == usual


def test_a_configuration_that_has_moved_keeps_the_data(tmp_path: Path, usual: Path) -> None:
    plant = config(tmp_path, "plant.toml")
    take(usual, plant)
    assert data_of(plant.rename(tmp_path / "moved.toml")) == usual


def test_a_directory_that_cannot_be_written_is_told_by_the_journal(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    take(tmp_path / "file" / "data", config(tmp_path, "plant.toml"))
