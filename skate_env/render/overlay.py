"""Overlays at world positions: forces, head target, ruler."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw, ImageFont

from .rink import NUMBERS
from .view import TO_BOTTOM, TO_RIGHT, View

PUSH, PULL, INK, PAPER, MARK = "#00795A", "#B3408F", "#1E2A38", "#FFFFFF", "#F0E442"
# Factor of supersampling.
_TIMES = 4
# Length of an arrow [m/N]; no arrow is longer than this [m], nor drawn below this force [N].
PER_NEWTON, _LONGEST, _LEAST = 0.4e-3, 1.1, 5.0
# Half width of an arrow's shaft, of its head, and its head's length [m].
_SHAFT, _HEAD, _POINT = 0.012, 0.037, 0.075
# Radii of the marker of the head's target and of its outer circle [m].
_DOT, _RING = 0.026, 0.060
Font = ImageFont.FreeTypeFont | ImageFont.ImageFont
Fill = str | tuple[int, int, int, int]
Points = Sequence[tuple[float, float]] | Sequence[NDArray[np.float64]] | NDArray[np.float64]


class Pen:
    """Draws antialiased shapes on a part of a picture, in the picture's coordinates."""

    def __init__(self, large: Image.Image, corner: tuple[int, int]) -> None:
        self._draw = ImageDraw.Draw(large)
        self._corner = np.array(corner)

    def polygon(self, points: Points, fill: str, halo: float = 0.0) -> None:
        """Fill a polygon, with a light halo around it [px]."""
        there = self._there(points)
        if halo:
            self._draw.line([*there, there[0], there[1]], PAPER, round(2 * _TIMES * halo), "curve")
        self._draw.polygon(there, fill)

    def line(self, points: Points, fill: str, width: float) -> None:
        """Draw a line [px]."""
        self._draw.line(self._there(points), fill, max(round(_TIMES * width), 1), "curve")

    def circle(self, centre: NDArray[np.float64], radius: float, fill: str) -> None:
        """Fill a circle [px]."""
        self._draw.circle(self._there([centre])[0], _TIMES * radius, fill)

    def rounded(self, box: tuple[float, float, float, float], radius: float, fill: Fill) -> None:
        """Fill a rectangle (left, top, right, bottom) with round corners [px]."""
        corners = self._there([box[:2], box[2:]])
        self._draw.rounded_rectangle(corners, _TIMES * radius, fill)

    def _there(self, points: Points) -> list[tuple[float, float]]:
        return [(float(x), float(y)) for x, y in _TIMES * (np.asarray(points) - self._corner)]


@contextmanager
def smooth(image: Image.Image, points: Points, margin: float) -> Iterator[Pen | None]:
    """Draw antialiased shapes around points [px]; yield None outside of the picture."""
    low = np.floor(np.min(points, axis=0) - margin)
    high = np.ceil(np.max(points, axis=0) + margin)
    left, top = (int(max(x, 0)) for x in low)
    right, bottom = (int(min(x, size)) for x, size in zip(high, image.size, strict=True))
    if right <= left or bottom <= top:
        yield None
        return
    size = (_TIMES * (right - left), _TIMES * (bottom - top))
    large = image.crop((left, top, right, bottom)).resize(size, Image.Resampling.NEAREST)
    yield Pen(large, (left, top))
    image.paste(large.reduce(_TIMES), (left, top))


def arrow(
    image: Image.Image,
    tail: NDArray[np.float64],
    tip: NDArray[np.float64],
    scale: float,
    colour: str,
) -> None:
    """Draw an arrow between two points [px]; `scale` is in pixels per metre."""
    length = float(np.linalg.norm(tip - tail))
    along = (tip - tail) / length
    aside = np.array([-along[1], along[0]]) * scale
    # A short arrow consists of its head.
    size = min(1.0, length / (_POINT * scale))
    neck = tip - size * _POINT * scale * along
    shaft, head = size * _SHAFT * aside, size * _HEAD * aside
    outline = np.array(
        [tail - shaft, neck - shaft, neck - head, tip, neck + head, neck + shaft, tail + shaft]
    )
    with smooth(image, outline, 4.0) as pen:
        if pen:
            pen.polygon(outline, colour, halo=1.3 * size)


def forces(
    image: Image.Image,
    soles: NDArray[np.float64],
    found: NDArray[np.float64],
    view: View,
    font: Font,
) -> None:
    """Draw the contact forces on both feet.

    Parameters
    ----------
    soles
        Heel and toe of the supporting and of the free foot (2, 2, 3) [m].
    found
        `Simulator.contact_forces` (2, 4) [N].
    """
    for sole, (friction, _, *normals) in zip(soles, found, strict=True):
        # Friction is divided between the ends in proportion to their loads.
        load = sum(map(abs, normals))
        # Labels of both ends have different anchors, so that they do not overlap.
        for place, normal, anchor in zip(sole, normals, ("rb", "lb"), strict=True):
            if abs(normal) < _LEAST:
                continue
            force = np.array([0.0, friction * abs(normal) / load, normal])
            size = float(np.linalg.norm(force))
            long = min(size * PER_NEWTON, _LONGEST)
            reach = force / size * long
            # A pushing force starts at the sole, a pulling one ends there.
            tail, tip = (place, place + reach) if normal > 0 else (place - reach, place)
            ends = view.pixels(np.array([tail, tip]))
            colour = PUSH if normal > 0 else PULL
            arrow(image, ends[0], ends[1], view.scale, colour)
            if long == _LONGEST:
                top = ends[np.argmin(ends[:, 1])] - [0.0, 0.02 * view.scale]
                label(image, top, f"{size / 1000:.1f} kN", font, colour, anchor)


def label(
    image: Image.Image, place: NDArray[np.float64], text: str, font: Font, colour: str, anchor: str
) -> None:
    """Write a text with a light halo at a point [px]."""
    ImageDraw.Draw(image).text(
        (float(place[0]), float(place[1])),
        text,
        colour,
        font,
        anchor,
        stroke_width=2,
        stroke_fill=PAPER,
    )


def mark(image: Image.Image, place: NDArray[np.float64], scale: float) -> None:
    """Draw the marker of the head's target at a point [px]."""
    ring, dot = _RING * scale, _DOT * scale
    with smooth(image, [place], 1.6 * ring + 1.0) as pen:
        if pen:
            for radius, colour in ((ring + 1.2, PAPER), (ring, INK), (0.74 * ring, MARK)):
                pen.circle(place, radius, colour)
            for turn in ((1.0, 0.0), (-1.0, 0.0), (0.0, 1.0), (0.0, -1.0)):
                ends = [place + 0.55 * ring * np.array(turn), place + 1.5 * ring * np.array(turn)]
                pen.line(ends, INK, 0.2 * ring)
            pen.circle(place, 0.6 * dot, INK)


def dashes(
    image: Image.Image, start: NDArray[np.float64], end: NDArray[np.float64], scale: float
) -> None:
    """Draw a dashed line between two points [px]."""
    count = int(np.linalg.norm(end - start) / (0.05 * scale))
    with smooth(image, [start, end], 3.0) as pen:
        if pen:
            for i in range(min(count, 1000)):
                ends = [start + (end - start) * (i + part) / count for part in (0.25, 0.75)]
                pen.line(ends, INK, 0.008 * scale)


def ruler(image: Image.Image, view: View, font: Font) -> None:
    """Write world y in metres below the ruler on the ice."""
    row = view.row + view.scale * TO_BOTTOM * NUMBERS
    left = view.column + view.scale * TO_RIGHT * NUMBERS
    first = int(np.ceil(view.camera - left / view.scale)) - 1
    draw = ImageDraw.Draw(image)
    for metre in range(first, first + int(view.width / view.scale) + 3):
        column = left + view.scale * (metre - view.camera)
        draw.text((column, row), f"{metre} m", INK, font, "mm")
