"""Oblique parallel projection from the world [m] to the picture [px].

World y points to the right and z upwards, both at true scale, so lengths in the plane of the motion
can be measured. World x, which points to the robot's right and towards the viewer, points to the
lower left: the right leg is the near one.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

# Shift of one metre towards the viewer, in metres of the picture: to the right, downwards.
TO_RIGHT, TO_BOTTOM = -0.30, 0.22
# Visible range: above the ice, below its middle line, and horizontally [m].
_ABOVE, _BELOW, _ASIDE = 2.27, 0.54, 3.4
# Position of the hips as a fraction of the width.
_HIPS = 0.45


@dataclass(frozen=True)
class View:
    """A camera: pixels per metre, and the pixel of the point (x, y, z) = (0, ``camera``, 0)."""

    width: int
    height: int
    scale: float
    column: float
    row: float
    camera: float

    @classmethod
    def fitting(cls, width: int, height: int) -> "View":
        """Fit standing robot, ice and ruler into a picture, the camera at y = 0."""
        scale = min(height / (_ABOVE + _BELOW), width / _ASIDE)
        # Remaining space is above the robot.
        return cls(width, height, scale, _HIPS * width, height - _BELOW * scale, 0.0)

    def at(self, camera: float) -> "View":
        """Move the camera along the ice to ``camera`` [m]."""
        return replace(self, camera=camera)

    def pixels(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return columns and rows (..., 2) of world points (..., 3)."""
        x, y, z = np.moveaxis(points, -1, 0)
        column = self.column + self.scale * (y - self.camera + TO_RIGHT * x)
        row = self.row + self.scale * (TO_BOTTOM * x - z)
        return np.stack([column, row], axis=-1)
