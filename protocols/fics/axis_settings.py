"""The shapes that settings of axes share: one value per axis, in user or in motor coordinates."""

from pydantic import Field

from protocols.fics.notation import (
    AXES,
    PLACES,
    Coordinates,
    KnownCoordinates,
    KnownNumbers,
    KnownPercents,
    KnownSpeeds,
    Percents,
    Speeds,
    Times,
)
from protocols.fics.row import RobotAction
from protocols.table import Reply, Retry

PERCENT = f"Percent of the maximum speed, 0.1-100. {AXES}"
SPEED = f"In mm/s, kpps or rpm as each axis is set up. {AXES}"
TIME = f"In milliseconds, 1-9999. {AXES}"


class SpeedPercents(Reply, args="{percents}"):
    """Share of the maximum speed that moves use."""

    percents: KnownPercents = Field(description="Percent, per axis.")


class AxisSpeeds(Reply, args="{speeds}"):
    """Speeds of the axes."""

    speeds: KnownSpeeds = Field(description="Per axis, in mm/s, kpps or rpm as it is set up.")


class AxisTimes(Reply, args="{times_ms}"):
    """Times of the axes."""

    times_ms: KnownNumbers = Field(description="Per axis, in milliseconds.")


class SetCoordinates(Reply, args="{coordinates}"):
    """Coordinates that are set."""

    coordinates: KnownCoordinates = Field(description="Per axis, in mm, pulse or degree as it is set up.")


class AxisSetting(RobotAction, blocked="abc", retry=Retry.SETTING):
    """A setting that can be read back."""


class PercentSetting(AxisSetting, args="{percents}", ranged=True):
    """A share of the maximum speed for each axis."""

    percents: Percents = Field(description=PERCENT)


class AxisSpeedSetting(AxisSetting, args="{speeds}"):
    """A speed for each axis."""

    speeds: Speeds = Field(description=SPEED)


class TimeSetting(AxisSetting, args="{times_ms}", ranged=True):
    """A time for each axis."""

    times_ms: Times = Field(description=TIME)


class CoordinateSetting(AxisSetting, args="{coordinates}"):
    """A coordinate for each axis."""

    coordinates: Coordinates = Field(description=PLACES)
