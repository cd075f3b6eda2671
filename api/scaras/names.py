"""What the paths of SCARA robots say."""

from typing import Annotated

from fastapi import Path

from protocols.rorze import interpolation

ScaraId = Annotated[str, Path(description="The robot's id in the configuration.", examples=["wafer"])]
PathNumber = Annotated[
    interpolation.Path, Path(description="Number of the interpolation path, 0-63.", examples=[3])
]
