"""Work that meets a fault of the gateway itself is begun again, less and less often."""

import asyncio
from itertools import pairwise

from gateway.core.own_faults import AGAIN_S, WELL_S, restart_after_faults
from tests.plants import in_virtual_time


@in_virtual_time
async def test_work_is_begun_again_until_it_comes_to_its_end() -> None:
    begun: list[float] = []

    async def work() -> None:
        begun.append(asyncio.get_running_loop().time())
        if len(begun) < 4:
            raise ZeroDivisionError

    await restart_after_faults("the work", work)
    assert begun == [0.0, 0.5, 1.5, 3.5]


@in_virtual_time
async def test_what_has_gone_on_well_is_begun_again_at_once() -> None:
    begun: list[float] = []

    async def work() -> None:
        begun.append(asyncio.get_running_loop().time())
        if len(begun) == 10:
            return
        if len(begun) == 8:
            await asyncio.sleep(WELL_S + 1)
        raise ZeroDivisionError

    await restart_after_faults("the work", work)
    pauses = [later - earlier for earlier, later in pairwise(begun)]
    assert pauses[6] == AGAIN_S[1]
    assert pauses[7] == WELL_S + 1 + AGAIN_S[0]
