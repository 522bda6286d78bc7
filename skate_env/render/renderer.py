"""Renderer of a simulator."""

from numbers import Integral

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from .._core import Simulator
from . import overlay
from .figure import solids
from .raster import Layer, paint
from .readouts import Readouts
from .rink import Rink
from .view import View

# Range of width and height of a picture [px]; smaller ones have no space for text.
_SIZES = {"width": (320, 4096), "height": (200, 4096)}
# Rows of `Simulator.link_segments`.
_SUPPORT_FOOT, _SUPPORT_SHANK, _WAIST, _FREE_FOOT, _HEAD = 0, 1, 3, 6, 16


class Renderer:
    """Draws pictures of one size.

    A picture depends on the simulator's state and scene only: equal states give equal pictures.
    The camera follows the hips. The robot skates to the right, with its right leg towards the
    viewer; the far limbs are paler. The supporting leg is orange, the free one blue.

    Parameters
    ----------
    width, height
        Size of the pictures [px]: 320 to 4096 wide, 200 to 4096 high.

    Raises
    ------
    TypeError, ValueError
        If a size is not a whole number, or out of range.
    """

    def __init__(self, width: int = 960, height: int = 540) -> None:
        self.width, self.height = _checked("width", width), _checked("height", height)
        self._view = View.fitting(self.width, self.height)
        self._rink = Rink(self._view)
        self._readouts = Readouts(self._view)

    def __reduce__(self) -> tuple[type["Renderer"], tuple[int, int]]:
        """Pickles and copies hold the size; fonts cannot be copied."""
        return type(self), (self.width, self.height)

    def draw(self, sim: Simulator) -> NDArray[np.uint8]:
        """Draw the state of a simulator; return a new array (height, width, 3)."""
        # Faint light underflows.
        with np.errstate(under="ignore"):
            return self._draw(sim)

    def _draw(self, sim: Simulator) -> NDArray[np.uint8]:
        links = sim.link_segments()
        view = self._view.at(float(links[_WAIST, :, 1].mean()))
        robot = solids(links, sim.support_leg)
        picture = self._rink.draw(robot, view)
        _blend(picture, paint(robot, view))
        image = Image.fromarray(picture)
        overlay.ruler(image, view, self._readouts.small)
        if lifting := sim.scene.get("control.lifting"):
            ahead = links[_SUPPORT_SHANK, 0, 1] + lifting["ahead"]
            target, head = view.pixels(np.array([[0.0, ahead, lifting["height"]], links[_HEAD, 1]]))
            overlay.dashes(image, head, target, view.scale)
            overlay.mark(image, target, view.scale)
        soles = links[[_SUPPORT_FOOT, _FREE_FOOT]]
        overlay.forces(image, soles, sim.contact_forces, view, self._readouts.small)
        mass = sum(body["mass"] for body in sim.bodies())
        speed = float(sim.momentum(sim.q, sim.v)[0]) / mass
        self._readouts.draw(image, sim, sim.scene.name, speed)
        return np.array(image)


def _checked(name: str, size: int) -> int:
    if isinstance(size, bool) or not isinstance(size, Integral):
        raise TypeError(f"{name} is {size!r}: it must be a whole number of pixels")
    least, most = _SIZES[name]
    if not least <= size <= most:
        raise ValueError(f"{name} is {size}: it must be {least} to {most} pixels")
    return int(size)


def _blend(picture: NDArray[np.uint8], layer: Layer | None) -> None:
    """Blend a layer into a picture."""
    if layer is None:
        return
    height, width = layer.planes.shape[1:]
    window = picture[layer.top : layer.top + height, layer.left : layer.left + width]
    clear = np.float32(1.0) - layer.planes[3]
    for channel, plane in enumerate(layer.planes[:3]):
        part = clear * window[..., channel]
        part += np.float32(255.0) * plane
        part += np.float32(0.5)
        window[..., channel] = part
