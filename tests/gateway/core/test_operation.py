"""A function describes an operation: by its signature, its docstring, and what its row says."""

from typing import Annotated

import pytest
from pydantic import BaseModel, Field

from gateway.core.operation import Expectation, Rows, Wait, adapter_of, in_camel_case, names_in, taking
from gateway.core.rights import Right
from protocols.table import Effect


class Thing:
    """The resource that the door finds."""


class Wish(BaseModel):
    """Content of a client's request."""

    on: bool = True


class Told(BaseModel):
    """The client's answer."""


def rows() -> Rows:
    made = Rows("things")

    @made.get("/things/{thing_id}/parts/{part}", tagged=True)
    async def get_part(
        thing: Thing, part: Annotated[int, Field(ge=1)], *, wait: Wait = None, needed: str
    ) -> Told:
        """Get a part.

        At once.
        """
        return Told()

    @made.put("/things/{thing_id}", Right.SETUP)
    async def set_thing(thing: Thing, wish: Wish, *, expects: Expectation | None) -> Told:
        """Set it."""
        return Told()

    @made.post("/things/{thing_id}/moves", Right.OPERATE, moves=True, planned=Wish)
    async def move_thing(thing: Thing, wish: Wish = Wish()) -> Told:  # noqa: B008  # it is frozen by nobody here
        """Move it."""
        return Told()

    @made.delete("/things", Right.ADMIN, name="end_all", description="End them.")
    async def whatever() -> Told:
        return Told()

    return made


def test_what_a_row_says() -> None:
    get, put, move, delete = rows()
    assert (get.name, get.title, get.description) == ("getPart", "Get Part", "Get a part.\n\nAt once.")
    assert (get.verb, get.right, get.leased, get.effect) == ("GET", Right.VIEW, False, Effect.READ)
    assert (get.target, get.named, get.tagged) == ("thing_id", ["thing_id", "part"], True)
    assert (list(get.parameters), get.provided) == (["part", "wait", "needed"], {"thing": Thing})
    assert [get.may_leave_out(name) for name in ("part", "wait", "needed", "thing_id")] == [
        False,
        True,
        False,
        False,
    ]
    assert (put.request_name, put.request, put.request_optional) == ("wish", Wish, False)
    assert (put.leased, put.effect, put.expects, get.expects) == (True, Effect.SETTING, True, False)
    assert (move.effect, move.request_optional, move.ended) == (Effect.MOTION, True, Told | Wish)
    assert (delete.name, delete.description, delete.target) == ("endAll", "End them.", None)
    assert (delete.effect, delete.leased, delete.ended) == (Effect.MAINTENANCE, False, Told)


def test_a_function_with_two_requests_is_no_operation() -> None:
    async def two(wish: Wish, other: Wish) -> Told:
        return Told()

    with pytest.raises(TypeError, match="two requests"):
        Rows("things").add("POST", "/things", Right.SETUP, two)


def test_a_function_that_is_made_says_what_it_takes() -> None:
    async def made(**values: object) -> Told:
        return Told()

    listed = Rows("things")
    listed.add("GET", "/things/{thing_id}", Right.VIEW, taking(made, thing_id=str, wait=Wait), name="get_it")
    [row] = listed
    assert list(row.parameters) == ["thing_id", "wait"]
    assert row.may_leave_out("wait")


def test_names() -> None:
    assert names_in("/robots/{robot_id}/units/{unit}") == ["robot_id", "unit"]
    assert names_in("/stop") == []
    assert in_camel_case("start_body_jog") == "startBodyJog"


def test_a_parameter_with_words_for_the_documents_alone_is_read_without_a_warning() -> None:
    kept = Annotated[int | None, Field(ge=1, deprecated=True)]  # warnings are errors here
    assert adapter_of(kept).validate_python("3") == 3
