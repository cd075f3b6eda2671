"""On whose behalf the running code acts."""

import asyncio

from gateway.core.origin import Origin, acting, current

ASKER = Origin("http 10.0.0.1", "4711")


def test_nobody_in_particular_is_the_gateway_itself() -> None:
    assert current() == Origin("gateway", None)


def test_an_origin_holds_as_long_as_somebody_acts() -> None:
    with acting(ASKER):
        with acting(Origin("gateway: fence")):
            assert current().caller == "gateway: fence"
        assert current() is ASKER
    assert current() == Origin("gateway")


def test_what_somebody_begins_goes_on_in_their_name() -> None:
    async def story() -> Origin:
        async def later() -> Origin:
            await asyncio.sleep(0)
            return current()

        with acting(ASKER):
            task = asyncio.create_task(later())
        assert current() == Origin("gateway")
        return await task

    assert asyncio.run(story()) is ASKER
