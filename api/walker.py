"""The one route of all operations: a request is led to its row of the door, and answered as the row says."""

from collections import defaultdict
from collections.abc import Iterable, Mapping, Sequence
from functools import cache, cached_property, lru_cache
from typing import Any, Final

from starlette.exceptions import HTTPException
from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import BaseRoute, Match
from starlette.types import Receive, Scope, Send

from api import by_hand, streams
from api.common.calling import Call
from api.common.idempotency import has_key
from api.common.problems import path_of
from api.common.requests import matching, plant_of, wait_s
from api.common.responses import response_of
from api.common.routes import Guarded
from gateway.door.calls import carry_out
from gateway.door.documents import expectation
from gateway.door.table import Operation, Right

KNOWN_PATHS: Final = 1024
"""Paths that were asked for of late, by clients who ask the same again and again."""
LONGEST_KNOWN: Final = 100
"""Characters of a path; longer ones are rare, and would take memory."""
WAIT: Final = "wait"
_ANY: Final = ""
"""Stands for a last word that is a parameter."""
BY_HAND: Final = {**by_hand.ANSWERS, **streams.ANSWERS}
"""Functions that answer instead of the door, by the names of operations."""


class ServedRow(Guarded):
    """A row of the door, as HTTP serves it."""

    def __init__(self, operation: Operation) -> None:
        super().__init__(right=operation.right, any_scope=operation.any_scope)
        self.operation, self.path, self.methods = operation, operation.path, {operation.verb}
        self.words = operation.path.split("/")
        self._named = [(at, word[1:-1]) for at, word in enumerate(self.words) if word.startswith("{")]
        self._fixed = [(at, word) for at, word in enumerate(self.words) if not word.startswith("{")]

    @cached_property
    def call(self) -> Call:
        """The parts of a request that it takes."""
        return Call(self.operation)

    def params_in(self, words: Sequence[str]) -> dict[str, str] | None:
        """The parameters in the words of a path; None where the path is another's."""
        if len(words) != len(self.words):
            return None
        for at, word in self._fixed:
            if words[at] != word:
                return None
        params = {name: words[at] for at, name in self._named}
        return params if all(params.values()) else None

    async def answer(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Do what is asked for, and tell what has come of it."""
        request = Request(scope, receive)
        values = await self.call.read(request)
        answer = BY_HAND.get(self.operation.name)
        response = await (answer(request, **values) if answer else self._carry_out(request, values))
        await response(scope, receive, send)

    async def _carry_out(self, request: Request, values: dict[str, Any]) -> Response:
        operation, waited_s, expects = self.operation, 0.0, None
        if WAIT in operation.parameters:
            waited_s = values[WAIT] = wait_s(request, values[WAIT])
        if operation.expects:
            expects = expectation(values.get(operation.request_name or ""), matching(request))
        keyed = operation.keyed and has_key(request.scope)
        result = await carry_out(plant_of(request), operation, values, expects, keyed=keyed)
        return response_of(request, operation, result, waited_s)

    async def refuse_method(self, _scope: Scope, _receive: Receive, _send: Send) -> None:
        """Refuse what is asked for by another method than that of the row."""
        raise HTTPException(405, headers={"Allow": self.operation.verb})


served_row = cache(ServedRow)
"""Makes the row once for all applications: it knows no plant."""


class Walker(BaseRoute):
    """The route of all rows. It finds one by method, and by number, first and last of the words of a path."""

    def __init__(self, operations: Iterable[Operation]) -> None:
        self.routes = [served_row(operation) for operation in operations]
        """The rows, in the order of the documents; each is served as a route of its own would be."""
        self._found = lru_cache(KNOWN_PATHS)(self._find)
        self._rows: defaultdict[tuple[str | int, ...], list[ServedRow]] = defaultdict(list)
        for row in self.routes:
            last = _ANY if row.words[-1].startswith("{") else row.words[-1]
            self._rows[row.operation.verb, len(row.words), *row.words[1:2], last].append(row)

    def prepare(self) -> None:
        """Have stops ready: none waits for a model."""
        for row in self.routes:
            if row.right is Right.STOP:
                row.call.prepare()

    def right_of(self, scope: Scope) -> Right | None:
        """The right that a request takes; None where nothing is here."""
        row = self.find(scope)
        return None if row is None else row.right

    def find(self, scope: Scope) -> ServedRow | None:
        """Find the row of a request, and note in the scope what its path says."""
        path = path_of(scope) if scope.get("root_path") else scope["path"]
        find = self._found if len(path) <= LONGEST_KNOWN else self._find
        row, params = find(scope["method"], path)
        if row is not None:
            scope["path_params"] = dict(params)
        return row

    def _find(self, method: str, path: str) -> tuple[ServedRow | None, Mapping[str, str]]:
        words = path.split("/")
        for last in (words[-1], _ANY):
            for row in self._rows.get((method, len(words), *words[1:2], last), ()):
                params = row.params_in(words)
                if params is not None:
                    return row, params
        return None, {}

    def matches(self, scope: Scope) -> tuple[Match, Scope]:
        """Tell whether a row is asked for, or another method of what is there."""
        if scope["type"] != "http":
            return Match.NONE, {}
        if self.find(scope) is not None:
            return Match.FULL, {}
        row, params = self._of_another_method(scope)
        return (Match.NONE, {}) if row is None else (Match.PARTIAL, {"path_params": params})

    async def handle(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Let the row of a request answer, or refuse its method."""
        row = self.find(scope)
        if row is not None:
            await row.let_in(row.answer, scope, receive, send)
            return
        other, _ = self._of_another_method(scope)
        if other is not None:
            await other.let_in(other.refuse_method, scope, receive, send)

    def _of_another_method(self, scope: Scope) -> tuple[ServedRow | None, Mapping[str, str]]:
        words = path_of(scope).split("/")
        found = ((row, row.params_in(words)) for row in self.routes)
        return next(((row, params) for row, params in found if params is not None), (None, {}))
