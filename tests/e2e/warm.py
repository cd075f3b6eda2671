"""The command line, loaded once: each program of a test is a fork of a process that has loaded it.

The installed command itself is run in test_cli, test_access, test_installation and test_life.
"""

import os
import sys
from collections.abc import Mapping, Sequence
from multiprocessing import get_context
from multiprocessing.context import ForkServerProcess
from pathlib import Path

from app.cli import main

_CONTEXT = get_context("forkserver")
_CONTEXT.set_forkserver_preload(["tests.e2e.loaded"])


def start(log: Path, arguments: Sequence[str]) -> ForkServerProcess:
    """Start `motion-gateway` with these arguments; every word goes to the log."""
    process = _CONTEXT.Process(target=_run, args=(log, arguments, dict(os.environ)))
    process.start()
    return process


def _run(log: Path, arguments: Sequence[str], environment: Mapping[str, str]) -> None:
    words = os.open(log, os.O_WRONLY | os.O_APPEND | os.O_CREAT, 0o600)
    for stream in (sys.stdout, sys.stderr):
        os.dup2(words, stream.fileno())
    os.environ.clear()
    os.environ.update(environment)
    sys.argv = ["motion-gateway", *arguments]
    main()
