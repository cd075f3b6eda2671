"""JOG sessions of robots: an axis moves for as long as somebody says so twice a second."""

from gateway.core.rights import Right
from gateway.fics.family import Fics
from gateway.fics.jogs import JogSession
from gateway.operations.caller import needs
from gateway.plant import Plant

# A session is opened by `do`, with the row StartJog.


@needs(Right.OPERATE)
async def heartbeat(plant: Plant, robot_id: str, jog_id: str) -> JogSession:
    """Let the axis move for another half second; errors as of `Jogs.heartbeat`."""
    return plant.family(Fics).robot(robot_id).jogs.heartbeat(jog_id)


@needs(Right.STOP)
async def end(plant: Plant, robot_id: str, jog_id: str) -> JogSession:
    """Stop the axis, and give the session when it stands still; errors as of `Jogs.end`."""
    return await plant.family(Fics).robot(robot_id).jogs.end(jog_id)
