"""Dialogues: a replay in virtual time as one text, which a test runs again to the last frame."""

import json
from collections.abc import Iterator
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, Final

from pydantic import ValidationError

from recordings.form import Clocks, Manifest, NotARecording
from recordings.replaying import Replay, Replayed, Script, Speed, run_loop
from transports.trace import TraceEntry

HEAD: Final = "motion-gateway dialogue 1"
BEGAN: Final = datetime(2000, 1, 1, tzinfo=UTC)


def dialogue_of(script: Script) -> tuple[str, Replayed]:
    """Play a recording once as fast as possible, and write what was said, to be said again.

    A difference that comes up says why there is no dialogue.
    """

    async def play() -> tuple[str, Replayed]:
        replay = Replay(script)
        replayed = await replay.run()
        return "".join(f"{line}\n" for line in _written(script, replay)), replayed

    return run_loop(play())


def _written(script: Script, replay: Replay) -> Iterator[str]:
    yield HEAD
    yield json.dumps(
        {
            "gateway": script.manifest.gateway,
            "configuration": script.manifest.configuration,
            "ports": {
                port.line.line_id: [port.byte_time_s, port.is_bridged] for port in replay.ports.values()
            },
        },
        ensure_ascii=False,
    )
    yield from (f"? {json.dumps(question, ensure_ascii=False)}" for question in replay.asked)
    for line_id, records in replay.said.items():
        yield f"= {line_id}"
        yield from (record.model_dump_json() for record in records)


def read(path: Path) -> tuple[Script, dict[str, Speed]]:
    """Read a dialogue, and the speeds of its ports.

    :raises NotARecording: it is none, or a line of it cannot be read.
    """
    head, *lines = path.read_text("utf-8").splitlines() or [""]
    if head != HEAD:
        raise NotARecording(f"{path} is no dialogue of version 1.")
    number = 2
    try:
        told: dict[str, Any] = json.loads(lines[0])
        requests: list[dict[str, Any]] = []
        records: dict[str, list[tuple[int, TraceEntry]]] = {}
        spoken: list[tuple[int, TraceEntry]] = []
        for number, line in enumerate(lines[1:], 3):  # noqa: B007  # the place of an error
            if line.startswith("? "):
                requests.append(json.loads(line[2:]))
            elif line.startswith("= "):
                spoken = records[line[2:]] = []
            else:
                spoken.append((len(spoken) + 1, TraceEntry.model_validate_json(line)))
        speeds = {line_id: (port[0], port[1]) for line_id, port in told["ports"].items()}
        manifest = _manifest(told, list(records))
    except (ValueError, KeyError, IndexError, ValidationError) as error:
        raise NotARecording(f"{path}:{number}: {error}.") from None
    return Script(manifest, records, {line_id: [] for line_id in records}, requests, exact=True), speeds


def _manifest(told: dict[str, Any], lines: list[str]) -> Manifest:
    return Manifest(
        gateway=told["gateway"],
        epoch="",
        from_=BEGAN,
        to=BEGAN,
        clocks=Clocks(at=BEGAN, monotonic_ns=0),
        lines=lines,
        configuration=told["configuration"],
    )
