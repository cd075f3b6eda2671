"""The state of a body at one moment, and the unit of its position."""

from gateway.rorze.live import BodyNow
from protocols.rorze.modes import GetOperatingMode, SetOperatingMode
from protocols.rorze.position import GetPosition, SetPosition
from tests.plants import in_virtual_time, rig


@in_virtual_time
async def test_a_position_is_told_with_what_it_is_counted_in() -> None:
    async with rig() as it:
        body = it.body()
        assert BodyNow.of(body).counted_in is None
        for command in (SetOperatingMode(mode="encoder"), SetPosition(position=70)):
            await body.ask(command)
        for question in (GetOperatingMode(), GetPosition()):
            await body.ask(question)
        now = BodyNow.of(body)
    assert (now.body_id, now.position, now.counted_in) == ("line1.3F", 70, "encoder_counts")
