"""The parts of a release: the changes of its version, and checksums."""

import re
import subprocess
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path
from typing import Any

import pytest

ROOT = Path(__file__).parents[2]
CHANGES = (
    "# Changelog\n\n## [Unreleased]\n\n- new\n\n## [0.2.0] - 2027-01-02\n\n- this\n\n## [0.1.0]\n\n- old\n"
)


@pytest.fixture(scope="module")
def release() -> Any:
    spec = spec_from_file_location("release", ROOT / "packaging" / "release.py")
    assert spec is not None
    assert spec.loader is not None
    module = module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.mark.parametrize(
    ("version", "told"), [("0.2.0", "- this\n"), ("0.1.0", "- old\n"), ("0.3.0", "- new\n")]
)
def test_the_notes_are_the_section_of_the_version(release: Any, version: str, told: str) -> None:
    assert release.notes(CHANGES, version) == told


def test_a_changelog_without_a_section_is_refused(release: Any) -> None:
    with pytest.raises(ValueError, match=r"has neither 0\.3\.0 nor Unreleased"):
        release.notes("# Changelog\n", "0.3.0")


def test_the_sums_can_be_checked_with_the_usual_program(release: Any, tmp_path: Path) -> None:
    for name in ("a.whl", "b.tgz"):
        (tmp_path / name).write_text(name)
    (tmp_path / "SHA256SUMS").write_text(release.sums(tmp_path))
    subprocess.run(["sha256sum", "--check", "--strict", "SHA256SUMS"], cwd=tmp_path, check=True)  # noqa: S607


def test_everything_that_is_copied_is_there(release: Any) -> None:
    assert all((ROOT / name).is_file() for name in release.RECIPES)
    assert release.BILL.is_file()


def test_the_image_of_a_release_is_made_of_its_wheel_and_that_of_the_sources_of_these(release: Any) -> None:
    texts = {Path(name).name: (ROOT / name).read_text("utf-8") for name in release.RECIPES}
    for name, line in release.OF_SOURCES.items():
        assert texts[name].count(line) == 1
        assert line not in release.recipe(name, texts[name])
    wheel = f"motion_gateway-{release.version()}-py3-none-any.whl"
    assert f"\nARG SOURCE={wheel}\n" in release.recipe("Dockerfile", texts["Dockerfile"])
    assert release.recipe("requirements.txt", texts["requirements.txt"]) == texts["requirements.txt"]


def test_recipes_and_documents_name_the_present_version(release: Any) -> None:
    """The wheel and the tag of the image: a version that is put into `pyproject.toml` alone fails here."""
    for name in ("Dockerfile", "packaging/compose.yaml", "docs/install.md"):
        named = re.findall(
            r"motion_gateway-(\d[\d.]*\d)-py3|motion-gateway:(\d[\d.]*\d)", (ROOT / name).read_text("utf-8")
        )
        assert {version for pair in named for version in pair if version} == {release.version()}, name
