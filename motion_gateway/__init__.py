"""The gateway in Python: installed, its packages lie in here, where they meet no others so called."""

import os
import sys


def use_own_packages() -> None:
    """Let this process import `gateway`, `api` and the others from here; in the sources they lie beside it.

    It comes before the first import of one of them.
    """
    here = os.path.dirname(__file__)  # noqa: PTH120  # no command waits for pathlib
    if os.path.isdir(os.path.join(here, "gateway")) and here not in sys.path:  # noqa: PTH112, PTH118  # as above
        sys.path.insert(0, here)


def main() -> None:
    """Run the command line."""
    use_own_packages()
    from app.cli import main as command_line

    command_line()
