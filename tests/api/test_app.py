"""The application as a whole: every error is a problem, and the documentation needs no internet."""

import re

from gateway.core.errors import Cancelled, GatewayError, NoReply, NotSent
from gateway.door.problems import problem_of
from tests.api.stand import Stand, on_stand

REPEATED_BY_CLIENTS = {408, 425, 429, 500, 502, 503, 504}


@on_stand()
async def test_what_is_not_there_is_a_problem_too(stand: Stand) -> None:
    for path in ("/nothing", "/bodies/", "/stop/", "/bodies/3F/moves/x/y"):
        answer = await stand.get(path)
        assert answer.status_code == 404
        assert answer.headers["content-type"] == "application/problem+json"
    wrong = await stand.client.delete("/stop")
    assert (wrong.status_code, wrong.headers["allow"]) == (405, "POST")
    assert wrong.json()["moved"] == "no"


@on_stand()
async def test_a_fault_of_the_gateway_is_a_problem_that_does_not_pretend(stand: Stand) -> None:
    def broken(_: str) -> object:
        raise ZeroDivisionError

    stand.plant.target = broken  # type: ignore[assignment,method-assign]  # a fault cannot be ordered otherwise
    answer = await stand.get("/bodies/3F/moves")
    assert (answer.status_code, answer.json()["moved"]) == (500, "unknown")
    assert "ZeroDivision" not in answer.text


@on_stand()
async def test_the_documentation_loads_nothing_from_elsewhere(stand: Stand) -> None:
    for path in ("/docs", "/redoc"):
        page = await stand.get(path)
        assert page.status_code == 200
        places = re.findall(r"""(?:src|href)=["']([^"']+)["']""", page.text)
        assert places
        for place in places:
            assert place.startswith("/")
            assert (await stand.get(place)).status_code == 200


def kinds(base: type[GatewayError] = GatewayError) -> set[type[GatewayError]]:
    return {base, *(kind for child in base.__subclasses__() for kind in kinds(child))}


def test_only_what_was_never_sent_has_a_status_that_clients_repeat() -> None:
    for kind in kinds():
        error = kind.__new__(kind)
        GatewayError.__init__(error, "It happened.", "Look.")
        vars(error).update(error_code=None, lasting=False)
        problem = problem_of(error, "/")
        if problem.status in REPEATED_BY_CLIENTS:
            assert issubclass(kind, NotSent)
            assert (problem.moved, problem.retryable) == ("no", True)


def test_what_a_stop_has_cancelled_is_not_repeated_by_a_client() -> None:
    problem = problem_of(Cancelled("A stop came first."), "/")
    assert (problem.status, problem.retryable) == (409, False)


def test_a_missing_reply_is_told_as_unknown() -> None:
    problem = problem_of(NoReply("Nothing came."), "/")
    assert (problem.status, problem.moved) == (409, "unknown")
