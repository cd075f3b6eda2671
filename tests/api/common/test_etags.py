"""Entity tags: who has read something else than there is now does not change it."""

import pytest
from pydantic import BaseModel
from starlette.requests import Request

from api.common.requests import matching
from api.common.responses import etag_of, header_of
from gateway.core.errors import Outdated
from gateway.door.documents import expectation
from gateway.door.problems import problem_of


class Document(BaseModel):
    name: str
    value: int


SEEN = Document(name="D1", value=7)
OTHER = Document(name="D1", value=8)


def request(*tags: str) -> Request:
    headers = [(b"if-match", tag.encode()) for tag in tags]
    return Request({"type": "http", "headers": headers})


def test_equal_documents_have_equal_tags_and_others_have_others() -> None:
    assert etag_of(SEEN) == etag_of(SEEN.model_copy())
    assert etag_of(SEEN) != etag_of(OTHER)
    assert header_of(SEEN) == {"ETag": etag_of(SEEN)}


@pytest.mark.parametrize(
    "tags", [(), ("*",), (etag_of(SEEN),), (f'"x", {etag_of(SEEN)}',), ('"x"', etag_of(SEEN))]
)
def test_the_present_state_is_changed(tags: tuple[str, ...]) -> None:
    expects = expectation(None, matching(request(*tags)))
    if expects is not None:
        expects(SEEN)


@pytest.mark.parametrize("tag", [etag_of(OTHER), f"W/{etag_of(SEEN)}", "nonsense", etag_of(SEEN).strip('"')])
def test_another_state_is_not_changed(tag: str) -> None:
    expects = expectation(None, matching(request(tag)))
    assert expects is not None
    with pytest.raises(Outdated):
        expects(SEEN)


def test_nothing_is_expected_where_any_state_will_do() -> None:
    assert matching(request()) is None
    assert matching(request("*")) is None


def test_it_is_told_as_412_and_nothing_has_moved() -> None:
    problem = problem_of(Outdated(), "/bodies/3F/settings")
    assert (problem.status, problem.moved, problem.retryable) == (412, "no", False)
