"""Faults of the gateway itself are survived in one place; other places that do so have their reasons."""

import ast
from collections.abc import Iterator
from pathlib import Path
from typing import Final

ROOT: Final = Path(__file__).parents[1]
FOLDERS: Final = ("api", "app", "gateway", "transports")
SUPERVISOR: Final = "gateway/core/supervisor.py"
EVERYTHING: Final = {"Exception", "BaseException", "BaseExceptionGroup", "ExceptionGroup"}
REASONS: Final = {
    "api/common/entrance.py _answer": "the top of a request: every error is its answer, and the server's log",
    "api/front/pending_requests.py run": "the top of a request's task: the connection is answered or closed",
    "api/front/websocket_protocol.py _run": "the top of a WebSocket's task: the connection is closed",
    "transports/recorder.py _note": "below the gateway: a trace that fails is given up, not its line",
    "transports/trace_file.py _write": "below the gateway: the top of a thread, which writes on",
}
"""The places beside the supervisor that go on after any exception, and why; the list only gets shorter."""


def survivors(path: Path) -> Iterator[str]:
    """The functions of a file that catch every exception, and do not end by passing it on."""
    tree = ast.parse(path.read_text("utf-8"))
    functions = [node for node in ast.walk(tree) if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef)]
    for function in functions:
        inner = {
            node
            for other in functions
            if other in set(ast.walk(function)) - {function}
            for node in ast.walk(other)
        }
        own = [node for node in ast.walk(function) if node not in inner]
        if any(_goes_on(node) for node in own):
            yield f"{path.relative_to(ROOT)} {function.name}"


def _goes_on(node: ast.AST) -> bool:
    if isinstance(node, ast.ExceptHandler):
        last = node.body[-1]
        passes_on = isinstance(last, ast.Raise) and last.exc is None
        return (node.type is None or _names_everything(node.type)) and not passes_on
    if not isinstance(node, ast.Call) or not isinstance(node.func, ast.Name):
        return False
    return node.func.id == "suppress" and any(map(_names_everything, node.args))


def _names_everything(type_: ast.expr) -> bool:
    named = type_.elts if isinstance(type_, ast.Tuple) else [type_]
    return any(isinstance(name, ast.Name) and name.id in EVERYTHING for name in named)


def test_only_the_supervisor_survives_a_fault_of_the_gateway_itself() -> None:
    files = (path for folder in FOLDERS for path in sorted((ROOT / folder).rglob("*.py")))
    found = {place for path in files for place in survivors(path) if not place.startswith(SUPERVISOR)}
    assert found == set(REASONS)


def test_what_catches_everything_is_found_in_each_form() -> None:
    handlers = ("except:", "except Exception:", "except (OSError, BaseException) as fault:")
    for handler in handlers:
        assert _found(f"try:\n        pass\n    {handler}\n        pass")
        assert not _found(f"try:\n        pass\n    {handler}\n        raise")
    assert _found("with suppress(Exception):\n        pass")
    assert not _found("try:\n        pass\n    except OSError:\n        pass")


def _found(body: str) -> bool:
    return any(map(_goes_on, ast.walk(ast.parse(f"def it():\n    {body}\n"))))
