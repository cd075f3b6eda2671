"""A whole server that is killed (kill -9) again and again, in processes that share one warm parent.

`python -m tests.e2e.killed_server CONFIG DATA` reads the names of log files, one a line: for each it starts a
server that says its words there, prints its process number, and waits for its end.
"""

import gc
import os
import sys
from pathlib import Path

from api import app as api
from app import server as _server  # noqa: F401  # loaded once for all lives
from app.cli import main as motion_gateway
from gateway.config import load
from gateway.plant import Plant


def main(config: str, data: str) -> None:
    """Fork as often as asked."""
    api.create_app(Plant(load(Path(config))))  # builds what all lives share
    gc.collect()
    gc.freeze()
    for log in sys.stdin:
        child = os.fork()
        if not child:
            words = os.open(log.strip(), os.O_WRONLY | os.O_APPEND | os.O_CREAT, 0o600)
            for stream in (sys.stdout, sys.stderr):
                os.dup2(words, stream.fileno())
            sys.stdin.close()
            sys.argv = ["motion-gateway", "serve", "--config", config, "--data", data]
            motion_gateway()
            os._exit(1)
        print(child, flush=True)
        os.waitpid(child, 0)


if __name__ == "__main__":
    main(*sys.argv[1:])
