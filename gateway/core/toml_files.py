"""Configuration files in TOML: read into a model, with the line of each fault."""

import re
import tomllib
from pathlib import Path
from typing import Final, TypeVar

from pydantic import BaseModel, ValidationError
from pydantic_core import ErrorDetails

from gateway.core.toml_lines import KeyPath, LineIndex
from protocols.wording import sentence

M = TypeVar("M", bound=BaseModel)

_WORDS: Final = {
    **dict.fromkeys(("model_type", "dict_type"), "must be a table"),
    "path_type": "must be a path in quotes",
    "string_type": "must be text in quotes",
}


class ConfigError(ValueError):
    """The configuration cannot be used: each line names file, line number, key and what is expected."""


def load(path: Path, model: type[M]) -> M:
    """Read a configuration file.

    :raises ConfigError: it cannot be read, or `parse` refuses it.
    """
    try:
        text = path.read_text("utf-8-sig")
    except (OSError, UnicodeDecodeError) as error:
        reason = error.strerror if isinstance(error, OSError) else "it is not UTF-8 text"
        raise ConfigError(f"{path}: cannot be read: {reason}") from error
    return parse(text, str(path), model)


def parse(text: str, name: str, model: type[M]) -> M:
    """Read a configuration; `name` is what errors call its file.

    :raises ConfigError: not TOML, or not a configuration; every fault that was found has a line of its own.
    """
    try:
        return model.model_validate(tomllib.loads(text))
    except ValidationError as error:
        index = LineIndex(text)
        faults = [(index.line_of(path), path, said) for path, said in map(_explain, error.errors())]
        faults.sort(key=lambda fault: fault[0])
        sentences = (f"{name}:{line}: {_written(path)}: {said}" for line, path, said in faults)
        raise ConfigError("\n".join(sentences)) from error
    # Not only TOMLDecodeError: an integer of 5000 digits, or arrays in arrays without an end.
    except (ValueError, RecursionError) as error:
        place = re.search(r"at line (\d+)", str(error))
        line = place[1] if place else len(text.splitlines()) or 1
        raise ConfigError(f"{name}:{line}: not valid TOML: {error}") from error


def _explain(error: ErrorDetails) -> tuple[KeyPath, str]:
    """Say in plain words where the fault is and what is expected there."""
    fault = error.get("ctx", {}).get("error")
    if isinstance(fault, ValueError):
        return (*error["loc"], *getattr(fault, "path", ())), str(fault)
    return error["loc"], sentence(error, _WORDS)


def _written(path: KeyPath) -> str:
    """Write a path as `lines[0].bodies[1].id`."""
    return "".join(f"[{part}]" if isinstance(part, int) else f".{part}" for part in path).lstrip(".")
