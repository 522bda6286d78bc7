"""Pictures of two simulators side by side, each with its name."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw, ImageFont

from .._core import Simulator
from .overlay import INK, PAPER
from .renderer import Renderer

# Height of the names' bar, as a fraction of the picture's; distance between the halves [px].
_BAR, _GAP = 0.08, 4
# The smallest picture whose halves have enough space for text [px].
_LEAST = (644, 217)
# Remaining contrast of a terminated simulation, and the grey it fades to.
_KEPT, _GREY = 0.45, 225.0


class SideBySide:
    """Draws pictures of two simulators.

    Parameters
    ----------
    width, height
        Size of the whole picture [px], at least 644 x 217.
    names
        Names above the left and the right half.

    Raises
    ------
    TypeError, ValueError
        If a size is not a whole number, or out of range.
    """

    def __init__(self, width: int, height: int, names: tuple[str, str]) -> None:
        if width < _LEAST[0] or height < _LEAST[1]:
            least = "x".join(map(str, _LEAST))
            raise ValueError(f"size {width}x{height}: two side by side need at least {least}")
        self.width, self.height = width, height
        self._names = names
        self._bar = round(_BAR * height)
        self._half = Renderer((width - _GAP) // 2, height - self._bar)
        self._font = ImageFont.load_default(0.6 * self._bar)

    def __reduce__(self) -> tuple[type["SideBySide"], tuple[int, int, tuple[str, str]]]:
        """Pickles and copies hold the arguments; fonts cannot be copied."""
        return type(self), (self.width, self.height, self._names)

    def draw(self, sims: Sequence[Simulator]) -> NDArray[np.uint8]:
        """Draw both states (height, width, 3); a terminated simulation is grey."""
        image = Image.new("RGB", (self.width, self.height), INK)
        draw = ImageDraw.Draw(image)
        places = (0, self.width - self._half.width)
        for sim, name, left in zip(sims, self._names, places, strict=True):
            picture = self._half.draw(sim)
            if sim.termination is not None:
                picture = _greyed(picture)
                name = f"{name}: {sim.termination} at {sim.time:.2f} s"
            image.paste(Image.fromarray(picture), (left, self._bar))
            middle = left + self._half.width / 2
            draw.text((middle, self._bar / 2), name, PAPER, self._font, "mm")
        return np.array(image)


def _greyed(picture: NDArray[np.uint8]) -> NDArray[np.uint8]:
    grey = picture.mean(axis=2, keepdims=True)
    pale = _GREY + _KEPT * (grey - _GREY)
    return np.repeat(pale.astype(np.uint8), 3, axis=2)
