"""What a body does is asked of it by its address, by callers with the right, and in their names."""

import pytest

from gateway.access.errors import NotPermitted
from gateway.access.principal import Principal, asking
from gateway.access.roles import Role
from gateway.core.errors import NotFound
from gateway.core.origin import Origin, current
from gateway.core.rights import Right
from gateway.operations.of_bodies import of_body
from gateway.rorze.bodies import Body
from tests.plants import in_virtual_time, rig

ME = Origin("test", "r-1")


async def work(body: Body, number: int, *, flash: bool) -> tuple[str, int, bool, Origin]:
    return body.address, number, flash, current()


@in_virtual_time
async def test_a_body_does_it_for_its_caller() -> None:
    operation = of_body(Right.VIEW, work)
    async with rig() as it:
        assert await operation(it.plant, ME, "3f", 7, flash=True) == ("line1.3F", 7, True, ME)
        assert current() != ME


@in_virtual_time
async def test_a_body_that_is_none_and_a_caller_without_the_right_are_refused() -> None:
    operation = of_body(Right.SETUP, work)
    async with rig() as it:
        with pytest.raises(NotFound):
            await operation(it.plant, ME, "55", 7, flash=True)
        with (
            asking(Principal("somebody", Role.OPERATOR, None, "s1")),
            pytest.raises(NotPermitted),
        ):
            await operation(it.plant, ME, "3F", 7, flash=True)
