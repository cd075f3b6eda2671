"""The ways of installation: the wheel, the source, the service, the image; each as far as it can be had here.

The wheel is installed into an environment of its own, which sees the dependencies of this one alone.
"""

import json
import os
import re
import shutil
import signal
import socket
import subprocess
import sys
import sysconfig
import tarfile
import tomllib
from collections.abc import Iterator
from ctypes.util import find_library
from dataclasses import dataclass, field
from fnmatch import fnmatch
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from zipfile import ZipFile

import httpx
import pytest
import yaml
from typer.main import get_command

from app.cli import app
from tests.certificates import write_certificate
from tests.e2e.processes import PATIENCE_S, simulated_line, until
from tests.sbom import bill

pytestmark = pytest.mark.prove

ROOT = Path(__file__).parents[2]
PACKAGING = ROOT / "packaging"
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))
WHEEL = PROJECT["tool"]["hatch"]["build"]["targets"]["wheel"]
PLACES = {"motion_gateway": "motion_gateway", **WHEEL["sources"]}
"""The packages, and where they are installed."""
SANDBOX = Path(__file__).with_name("sandbox.py")
EXPOSED = 20
"""The unit's exposure as systemd reckons it, in tenths, is no more than this."""


def run(*words: str | Path, cwd: Path, **environment: str) -> str:
    """Run a program that knows nothing of where it was started, and give what it said."""
    done = subprocess.run(  # noqa: S603
        [str(word) for word in words],
        cwd=cwd,
        env=environment,
        capture_output=True,
        text=True,
        check=False,
        timeout=6 * PATIENCE_S,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout + done.stderr


def build(source: Path, into: Path, *targets: str) -> None:
    """Build without network and isolation, as `make` installs."""
    run(sys.executable, "-m", "hatchling", "build", *targets, "-d", into, cwd=source)


@dataclass
class Installed:
    """An environment with the gateway in it."""

    folder: Path

    @property
    def python(self) -> Path:
        return self.folder / "bin" / "python"

    @property
    def command(self) -> Path:
        return self.folder / "bin" / "motion-gateway"

    def run(self, *words: str, **environment: str) -> str:
        return run(self.command, *words, cwd=self.folder, **environment)

    def start(self, *words: str, **environment: str) -> "subprocess.Popen[str]":
        return subprocess.Popen(  # noqa: S603
            [self.command, *words],
            cwd=self.folder,
            env={"PYTHONUNBUFFERED": "1", **environment},
            stderr=subprocess.PIPE,
            text=True,
        )


def environment_at(folder: Path) -> Installed:
    """Make an environment that sees the dependencies of this one, but not this project."""
    run(sys.executable, "-m", "venv", "--without-pip", folder, cwd=ROOT)
    (packages,) = folder.glob("lib/python*/site-packages")
    (packages / "dependencies.pth").write_text(sysconfig.get_path("purelib"), "utf-8")
    return Installed(folder)


def install(into: Installed, what: Path) -> None:
    pip = (sys.executable, "-m", "pip", "--python", into.python, "install", "--no-index", "--no-deps")
    run(*pip, "--no-build-isolation", "--quiet", what, cwd=ROOT, PIP_DISABLE_PIP_VERSION_CHECK="1")


@pytest.fixture(scope="module")
def distributions(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    """The wheel and the source distribution."""
    into = tmp_path_factory.mktemp("dist")
    build(ROOT, into)
    (wheel,), (source,) = into.glob("*.whl"), into.glob("*.tar.gz")
    return wheel, source


@pytest.fixture(scope="module")
def installed(distributions: tuple[Path, Path], tmp_path_factory: pytest.TempPathFactory) -> Installed:
    environment = environment_at(tmp_path_factory.mktemp("installed") / "venv")
    install(environment, distributions[0])
    return environment


def served(process: "subprocess.Popen[str]") -> str:
    """Where a gateway that was started listens."""
    assert process.stderr is not None
    said = ""
    for line in process.stderr:
        said += line
        if found := re.search(r"running on (https?://\S+)", line):
            return found[1]
    raise AssertionError(said)


@pytest.fixture(scope="module")
def demo(installed: Installed) -> Iterator[str]:
    """The URL of the demo that the installed command serves."""
    process = installed.start("serve", "--demo", "--port", "0")
    try:
        url = served(process)
        until(lambda: httpx.get(f"{url}/readyz").is_success, "the demo is ready")
        yield url
    finally:
        process.terminate()
        process.communicate(timeout=PATIENCE_S)
        assert process.returncode == 0


# wheel and source


def test_everything_of_the_packages_is_in_the_wheel(distributions: tuple[Path, Path]) -> None:
    names = set(ZipFile(distributions[0]).namelist())
    for package, place in PLACES.items():
        for file in (ROOT / package).rglob("*"):
            if file.is_file() and "__pycache__" not in file.parts:
                assert f"{place}/{file.relative_to(ROOT / package).as_posix()}" in names
    tops = {name.partition("/")[0] for name in names}
    assert {top.rpartition(".")[2] for top in tops} == {"motion_gateway", "dist-info", "data"}


def test_the_wheel_has_its_bill_of_materials(distributions: tuple[Path, Path]) -> None:
    with ZipFile(distributions[0]) as wheel:
        (place,) = (name for name in wheel.namelist() if ".dist-info/sboms/" in name)
        assert json.loads(wheel.read(place)) == bill()


def test_the_source_makes_the_same_wheel(distributions: tuple[Path, Path], tmp_path: Path) -> None:
    wheel, source = distributions
    with tarfile.open(source) as archive:
        archive.extractall(tmp_path, filter="data")
    (unpacked,) = tmp_path.iterdir()
    (unpacked / "key").write_text("secret")
    build(unpacked, tmp_path / "dist")
    (again,), (source_again,) = (tmp_path / "dist").glob("*.whl"), (tmp_path / "dist").glob("*.tar.gz")
    assert set(ZipFile(again).namelist()) == set(ZipFile(wheel).namelist())
    with tarfile.open(source) as first, tarfile.open(source_again) as second:
        assert set(second.getnames()) == set(first.getnames()), "without the key that lies there"


def test_the_installed_command_runs_what_was_installed(installed: Installed) -> None:
    assert installed.run("--version").strip() == PROJECT["project"]["version"]
    names = ", ".join(WHEEL["sources"])
    code = "import motion_gateway; motion_gateway.use_own_packages(); "
    code += f"import json, {names}; print(json.dumps([it.__file__ for it in ({names})]))"
    files = json.loads(run(installed.python, "-c", code, cwd=installed.folder))
    assert all(Path(file).is_relative_to(installed.folder) for file in files)


def test_it_meets_no_other_packages_of_its_names(distributions: tuple[Path, Path], tmp_path: Path) -> None:
    """It is installed beside others that are called as its own are, and leaves them alone."""
    environment = environment_at(tmp_path / "venv")
    (packages,) = environment.folder.glob("lib/python*/site-packages")
    for folder in (packages, tmp_path):
        for name in WHEEL["sources"]:
            (folder / name).mkdir()
            (folder / name / "__init__.py").write_text("OTHER = True\n", "utf-8")
    install(environment, distributions[0])
    for words in ((environment.command,), (environment.python, "-m", "motion_gateway")):
        said = run(*words, "simulate", "rc400", "--help", cwd=tmp_path, NO_COLOR="1", TERM="dumb")
        assert "--bodies" in said
    process = environment.start("demo", "--port", "0")
    try:
        url = served(process)
        until(lambda: httpx.get(f"{url}/readyz").is_success, "the demo is ready")
        assert '"succeeded"' in environment.run("move", "3F", "relative", "5", "--wait", "20", "--url", url)
    finally:
        process.terminate()
        process.communicate(timeout=PATIENCE_S)
    names = ", ".join(WHEEL["sources"])
    code = f"import {names}; print(all(it.OTHER for it in ({names})))"
    assert run(environment.python, "-c", code, cwd=environment.folder).strip() == "True"


def test_it_has_all_it_serves(demo: str) -> None:
    paths = httpx.get(f"{demo}/openapi.json").raise_for_status().json()["paths"]
    assert paths.keys() == json.loads((ROOT / "openapi" / "openapi.json").read_text("utf-8"))["paths"].keys()
    page = httpx.get(f"{demo}/docs").raise_for_status().text
    assets = re.findall(r'(?:src|href)="(/[^"]+)"', page)
    assert assets
    for asset in assets:
        httpx.get(demo + asset).raise_for_status()
    assert "motion_gateway_line" in httpx.get(f"{demo}/metrics").raise_for_status().text


def test_a_motor_moves(installed: Installed, demo: str) -> None:
    said = installed.run("move", "3F", "relative", "500", "--wait", "20", MOTION_GATEWAY_URL=demo)
    assert '"status": "succeeded"' in said
    assert "line1.3F" in installed.run("status", MOTION_GATEWAY_URL=demo)


def test_shells_complete_its_commands(installed: Installed) -> None:
    typed = {"COMP_WORDS": "motion-gateway st", "COMP_CWORD": "1"}
    said = installed.run(_MOTION_GATEWAY_COMPLETE="complete_bash", **typed)
    assert said.split() == ["status", "stop"]


def test_it_holds_the_simulator(installed: Installed) -> None:
    assert "--bodies" in installed.run("simulate", "rc400", "--help", NO_COLOR="1", TERM="dumb")


def test_the_service_and_the_rules_come_with_it(installed: Installed) -> None:
    for name in ("motion-gateway.service", "60-motion-gateway.rules"):
        shared = installed.folder / "share" / "motion-gateway" / name
        assert shared.read_bytes() == (PACKAGING / name).read_bytes()


# the service


@pytest.fixture
def unit(installed: Installed, tmp_path: Path) -> Path:
    """The unit, with its commands where they are here."""
    text = (PACKAGING / "motion-gateway.service").read_text("utf-8")
    assert text.count("/opt/motion-gateway/bin/motion-gateway ") == 1
    file = tmp_path / "motion-gateway.service"
    file.write_text(text.replace("/opt/motion-gateway", str(installed.folder)), "utf-8")
    return file


needs_systemd = pytest.mark.skipif(shutil.which("systemd-analyze") is None, reason="there is no systemd here")


@needs_systemd
def test_process_understands_the_unit(unit: Path) -> None:
    assert run("systemd-analyze", "verify", unit, cwd=unit.parent, PATH=os.environ["PATH"]) == ""


@needs_systemd
def test_the_unit_leaves_the_gateway_little_to_do_harm_with(unit: Path) -> None:
    words = ("--offline=true", f"--threshold={EXPOSED}", "--no-pager", unit)
    run("systemd-analyze", "security", *words, cwd=unit.parent, PATH=os.environ["PATH"])


@needs_systemd
@pytest.mark.skipif(find_library("seccomp") is None, reason="there is no libseccomp here")
def test_the_gateway_does_without_what_the_unit_forbids(installed: Installed, unit: Path) -> None:
    process = subprocess.Popen(  # noqa: S603
        [sys.executable, SANDBOX, unit, installed.command, "serve", "--demo", "--port", "0"],
        env={"PATH": os.environ["PATH"], "PYTHONUNBUFFERED": "1"},
        stderr=subprocess.PIPE,
        text=True,
    )
    try:
        assert process.stderr is not None
        assert process.stderr.readline() == "confined\n"
        url = served(process)
        until(lambda: httpx.get(f"{url}/readyz").is_success, "the demo is ready")
        for words in (("3F", "relative", "100"), ("r1/units/1", "home")):
            installed.run("move", *words, "--wait", "30", MOTION_GATEWAY_URL=url)
    finally:
        process.terminate()
        _, said = process.communicate(timeout=PATIENCE_S)
    assert process.returncode == 0
    assert "Error" not in said


def test_the_service_manager_hears_of_begin_life_and_end(installed: Installed, tmp_path: Path) -> None:
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as manager:
        manager.bind(str(tmp_path / "notify"))
        manager.settimeout(PATIENCE_S)
        told = {"NOTIFY_SOCKET": str(tmp_path / "notify"), "WATCHDOG_USEC": "60000000"}
        process = installed.start("serve", "--demo", "--port", "0", **told)
        try:
            assert [manager.recv(100), manager.recv(100)] == [b"READY=1\nSTATUS=", b"WATCHDOG=1"]
            process.send_signal(signal.SIGTERM)
            until(lambda: manager.recv(100) == b"STOPPING=1", "it says that it ends")
        finally:
            process.terminate()
            process.communicate(timeout=PATIENCE_S)
    assert process.returncode == 0


def test_every_rule_for_ports_is_one() -> None:
    lines = (PACKAGING / "60-motion-gateway.rules").read_text("utf-8").splitlines()
    rules = [line for line in lines if line and not line.startswith("#")]
    part = r'[A-Z]+(?:\{[A-Za-z_]+\})?(?:==|\+=|=)"[^"]*"'
    assert rules
    for rule in rules:
        assert re.fullmatch(rf"{part}(?:, {part})*", rule), rule
        assert 'SYMLINK+="motion/' in rule


# the image


@dataclass
class Image:
    """The image that a Dockerfile's steps make, without an engine: files, settings, installed packages."""

    folder: Path
    sources: Path = ROOT
    arguments: dict[str, str] = field(default_factory=dict)
    python: str = ""
    user: str = "root"
    users: list[str] = field(default_factory=list)
    settings: dict[str, str] = field(default_factory=dict)
    command: list[str] = field(default_factory=list)
    health: list[str] = field(default_factory=list)
    place: str = "/"

    def __post_init__(self) -> None:
        self.environment = environment_at(self.folder / "environment")

    def path(self, inside: str) -> Path:
        return self.folder / "root" / (Path(self.place) / inside).as_posix().lstrip("/")

    def step(self, instruction: str, words: str) -> None:
        for name, value in self.arguments.items():
            words = words.replace(f"${{{name}}}", value)
        getattr(self, f"_{instruction.lower()}")(words)

    def _arg(self, words: str) -> None:
        name, _, value = words.partition("=")
        self.arguments[name] = value

    def _from(self, words: str) -> None:
        self.python = words.removeprefix("python:").partition("-")[0]

    def _env(self, words: str) -> None:
        self.settings |= dict(word.split("=", 1) for word in words.split())

    def _workdir(self, words: str) -> None:
        self.place = words
        self.path(".").mkdir(parents=True, exist_ok=True)

    def _user(self, words: str) -> None:
        assert words in self.users
        self.user = words

    def _volume(self, words: str) -> None:
        assert self.path(words).is_dir()

    def _copy(self, words: str) -> None:
        source, target = words.split()
        for file in sorted(context(self.sources)):
            if source == "." or file.as_posix() == source:
                copy = self.path(target) / file
                copy.parent.mkdir(parents=True, exist_ok=True)
                shutil.copyfile(self.sources / file, copy)

    def _run(self, words: str) -> None:
        if words.startswith("useradd "):
            self.users.append(words.split()[-1])
            return
        assert words.startswith("pip install "), words
        options = words.split()[2:]
        if options[-1].startswith("./"):
            assert options[:-1] == ["--no-deps", "--no-build-isolation"]
            install(self.environment, self.path(options[-1]))
        else:
            assert options[:2] == ["--require-hashes", "-r"]
            assert not missing_pins(self.path(options[2]))

    def _cmd(self, words: str) -> None:
        self.command = json.loads(words)

    def _healthcheck(self, words: str) -> None:
        self.health = json.loads(words.partition(" CMD ")[2])


def context(sources: Path = ROOT) -> list[Path]:
    """The files that are sent to the builder: what .dockerignore lets through, or all of a release."""
    if sources != ROOT:
        return [file.relative_to(sources) for file in sources.iterdir()]
    lines = (ROOT / ".dockerignore").read_text("utf-8").splitlines()
    rules = [line for line in lines if line and not line.startswith("#")]
    kept = {rule[1:] for rule in rules if rule.startswith("!")}
    dropped = [rule.removeprefix("**/") for rule in rules if rule.startswith("**/")]
    files: list[Path] = []
    for name in kept:
        found = (ROOT / name).rglob("*") if (ROOT / name).is_dir() else [ROOT / name]
        files += [file.relative_to(ROOT) for file in found if file.is_file()]
    return [file for file in files if not any(fnmatch(part, rule) for part in file.parts for rule in dropped)]


def missing_pins(requirements: Path) -> list[str]:
    """The pinned versions that the tests do not run with; those for other systems do not count."""
    missing = []
    for line in requirements.read_text("utf-8").splitlines():
        pin = re.match(r"([A-Za-z0-9_.-]+)(?:\[\w+\])?==(\S+)", line)
        if pin is None or ";" in line:
            continue
        try:
            if version(pin[1]) != pin[2]:
                missing.append(line)
        except PackageNotFoundError:
            missing.append(line)
    return missing


@pytest.fixture(scope="module", params=["sources", "release"])
def image(
    request: pytest.FixtureRequest, distributions: tuple[Path, Path], tmp_path_factory: pytest.TempPathFactory
) -> Image:
    """The image, made by the steps of the Dockerfile: of the sources, and of what a release has."""
    made = Image(tmp_path_factory.mktemp("image"))
    recipe = (ROOT / "Dockerfile").read_text("utf-8")
    if request.param == "release":
        made.sources = tmp_path_factory.mktemp("release")
        shutil.copy(distributions[0], made.sources)
        shutil.copy(ROOT / "requirements.txt", made.sources)
        recipe = recipe.replace("ARG SOURCE=.", f"ARG SOURCE={distributions[0].name}")
    text = re.sub(r"\\\n\s*", "", re.sub(r"(?m)^#.*\n", "", recipe))
    for line in text.splitlines():
        if line:
            made.step(*line.split(" ", 1))
    return made


def test_the_image_serves_and_holds_the_simulator(image: Image) -> None:
    assert image.python.startswith(PROJECT["project"]["requires-python"].removeprefix(">="))
    assert image.user == "motion-gateway"
    assert image.command[:2] == ["motion-gateway", "serve"]
    assert "--bodies" in image.environment.run("simulate", "rc400", "--help", NO_COLOR="1", TERM="dumb")
    process = image.environment.start("serve", "--demo", "--port", "0", **image.settings)
    try:
        url = served(process)
        _, *words = image.health
        run(image.environment.python, *words, cwd=image.folder, MOTION_GATEWAY_URL=url)
    finally:
        process.terminate()
        process.communicate(timeout=PATIENCE_S)


def test_nothing_private_is_sent_to_the_builder() -> None:
    outside = {file.parts[0] for file in context()} - {*PLACES, "openapi", "packaging"}
    assert outside == {"pyproject.toml", "README.md", "requirements.txt"}


def test_compose_starts_what_there_is() -> None:
    compose = yaml.safe_load((PACKAGING / "compose.yaml").read_text("utf-8"))
    gateway, demo = compose["services"]["gateway"], compose["services"]["demo"]
    assert (PACKAGING / gateway["build"] / "Dockerfile").resolve() == ROOT / "Dockerfile"
    assert gateway["image"] == f"motion-gateway:{PROJECT['project']['version']}"
    assert {volume.partition(":")[0] for volume in gateway["volumes"]} - {"/etc/motion-gateway"} == set(
        compose["volumes"]
    )
    assert demo["command"] == ["motion-gateway", "serve", "--demo"]
    assert not demo.keys() & {"devices", "volumes"}, "it needs nothing that only a plant has"
    hardened = {"read_only": True, "cap_drop": ["ALL"], "security_opt": ["no-new-privileges:true"]}
    for service in (gateway, demo):
        assert service.items() >= hardened.items()


# the documents


def test_every_command_in_the_documents_is_one() -> None:
    commands = set(getattr(get_command(app), "commands", {})) | {"keys", "--version"}
    for name in ("docs/install.md", "docs/proxy.md", "docs/command-line.md", "README.md"):
        text = (ROOT / name).read_text("utf-8")
        used = set(re.findall(r"(?m)^ {4}(?:sudo )?(?:\S+/)?motion-gateway (\S+)", text))
        assert used <= commands, used - commands
        for link in re.findall(r"\]\(([^)#:]+)\)", text):
            assert (ROOT / name).parent.joinpath(link).exists(), link


def written(section: str) -> list[str]:
    """The blocks of commands, or of configuration, in a section of the document, as they stand there."""
    text = (ROOT / "docs" / "install.md").read_text("utf-8")
    (content,) = re.findall(rf"(?ms)^## {re.escape(section)}\n(.*?)(?=^## |\Z)", text)
    blocks = re.findall(r"(?m)(?:^ {4}.*\n)+", content)
    return [re.sub(r"(?m)^ {4}", "", block) for block in blocks]


@pytest.mark.long
def test_from_nothing_to_a_moving_motor_over_tls_by_the_words_of_the_document(
    installed: Installed, tmp_path: Path
) -> None:
    """Only the place of the controller, the host, its port and the files of the certificate are others."""
    (search,) = written("3. The configuration")
    keep, begin = written("4. The first move")
    _, server, elsewhere = written("6. From another machine")
    with simulated_line(tmp_path, "3F") as line, socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
        taken.close()
        certificate, key = write_certificate(tmp_path, "first")
        others = {
            "/dev/serial/by-id/usb-FTDI_1234-if00-port0": line.place,
            "/etc/motion-gateway/certificate.pem": str(certificate),
            "/etc/motion-gateway/key.pem": str(key),
            "gateway-host.example": "127.0.0.1",
            "8420": str(port),
        }

        def here(text: str) -> str:
            for word, other in others.items():
                text = text.replace(word, other)
            return text

        environment = {
            "PATH": f"{installed.folder / 'bin'}:{os.environ['PATH']}",
            "SSL_CERT_FILE": str(certificate),
        }

        def shell(text: str) -> str:
            return run("bash", "-euo", "pipefail", "-c", here(text), cwd=tmp_path, **environment)

        assert "is in order" in shell(search)
        file = tmp_path / "gateway.toml"
        its_own = re.compile(r"^\[server\]\n.*?(?=^\[\[|^# An RC)", re.MULTILINE | re.DOTALL)
        file.write_text(its_own.sub(here(f"{server}port = {port}\n"), file.read_text("utf-8")))
        *before, serve = keep.splitlines()
        shell("\n".join(before))
        words = serve.split()[1:]
        process = subprocess.Popen(  # noqa: S603
            [installed.command, *words], cwd=tmp_path, env=environment, stderr=subprocess.PIPE, text=True
        )
        try:
            assert served(process) == f"https://0.0.0.0:{port}"
            said = shell(f"{elsewhere}\n{begin}")
            assert '"status": "succeeded"' in said
            assert "line1.3F" in said
            assert len(line.executed("1+M")) == 1
        finally:
            process.terminate()
            process.communicate(timeout=PATIENCE_S)
