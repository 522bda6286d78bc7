"""Shaded solids on transparent ground: tapered capsules, which are spheres swept along a line.

Every pixel's distance to a solid's outline has a closed form, which gives smooth edges, and so have
normal and depth, which give light, shade, and limbs that pass behind each other.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .view import View

Array = NDArray[np.float32]

# Towards the light: right, up, at the viewer; a unit vector.
LIGHT = np.array([-0.42, 0.70, 0.58]) / np.linalg.norm([-0.42, 0.70, 0.58])
_AMBIENT, _DIFFUSE, _GLOSS = 0.52, 0.56, 0.16
# How dark a solid is where its surface turns away from the viewer.
_RIM = 0.72


@dataclass(frozen=True)
class Solid:
    """A tapered capsule from ``start`` to ``end`` (3,) [m] with the radii there [m]."""

    start: NDArray[np.float64]
    end: NDArray[np.float64]
    radii: tuple[float, float]
    colour: tuple[float, float, float]


@dataclass(frozen=True)
class Layer:
    """Red, green and blue, multiplied by the opacity, and that (4, h, w), 0 to 1; its corner."""

    planes: Array
    left: int
    top: int


def paint(solids: list[Solid], view: View) -> Layer | None:
    """Paint solids as ``view`` shows them; None if nothing of them is in the picture."""
    ends = np.array([(solid.start, solid.end) for solid in solids])
    radii = np.array([solid.radii for solid in solids]) * view.scale
    centres = view.pixels(ends)
    reach = radii.max(axis=1)[:, None] + 1.0
    size = np.array([view.width, view.height])
    lows = np.clip(np.floor(centres.min(axis=1) - reach), 0, size).astype(int)
    highs = np.clip(np.ceil(centres.max(axis=1) + reach) + 1, 0, size).astype(int)
    low, high = lows.min(axis=0), highs.max(axis=0)
    if (high <= low).any():
        return None
    planes = np.zeros((4, high[1] - low[1], high[0] - low[0]), np.float32)
    nearest = np.full(planes.shape[1:], -np.inf, np.float32)
    depths = (ends[:, :, 0] * view.scale).astype(np.float32)
    # From far to near, so that smooth edges blend with what is behind them.
    for i in np.argsort(depths.mean(axis=1), kind="stable"):
        (left, top), (right, bottom) = lows[i] - low, highs[i] - low
        if right > left and bottom > top:
            columns = np.arange(lows[i, 0], highs[i, 0], dtype=np.float32) + np.float32(0.5)
            rows = np.arange(lows[i, 1], highs[i, 1], dtype=np.float32) + np.float32(0.5)
            _blend(
                planes[:, top:bottom, left:right],
                nearest[top:bottom, left:right],
                columns[None, :],
                rows[:, None],
                centres[i],
                depths[i],
                radii[i],
                solids[i].colour,
            )
    return Layer(planes, int(low[0]), int(low[1]))


def _blend(
    planes: Array,
    nearest: Array,
    columns: Array,
    rows: Array,
    centres: NDArray[np.float64],
    depths: Array,
    radii: NDArray[np.float64],
    colour: tuple[float, float, float],
) -> None:
    """Blend one solid into a window of the layer, which has these columns and rows."""
    (ax, ay), (bx, by) = centres
    length = float(np.hypot(bx - ax, by - ay))
    first, last = radii
    ux, uy, taper = 1.0, 0.0, 0.0
    if length > abs(first - last) + 1e-3:
        ux, uy, taper = (bx - ax) / length, (by - ay) / length, (first - last) / length
    else:
        # Seen from its end: the larger sphere hides the other.
        larger = int(last > first)
        (ax, ay), first, length = centres[larger], radii[larger], 0.0
        depths = depths[[larger, larger]]
    f = np.float32
    x, y = columns - f(ax), rows - f(ay)
    across = np.abs(f(uy) * x - f(ux) * y)
    # The sphere whose outline is nearest: its place along the axis, and its radius.
    place = f(ux) * x + f(uy) * y
    place -= f(taper / np.sqrt(1.0 - taper**2)) * across
    np.maximum(place, f(0.0), out=place)
    np.minimum(place, f(length), out=place)
    radius = f(first) - f(taper) * place
    dx, dy = x - f(ux) * place, y - f(uy) * place
    distance = dx * dx
    distance += dy * dy
    np.sqrt(distance, out=distance)
    cover = radius - distance
    cover += f(0.5)
    # The normal's parts to the right, downwards, to the viewer: dx, dy and this over the radius.
    np.minimum(distance, radius, out=distance)
    turned = np.sqrt(radius * radius - distance * distance)
    rise = f((depths[1] - depths[0]) / length) if length else f(0.0)
    depth = rise * place
    depth += turned
    depth += depths[0]
    # Where two solids run into each other, one fades into the other.
    before = depth - nearest
    before *= f(0.5)
    before += f(0.5)
    for share in (cover, before):
        np.maximum(share, f(0.0), out=share)
        np.minimum(share, f(1.0), out=share)
    cover *= before
    np.copyto(nearest, depth, where=cover > f(0.5))
    dx *= f(LIGHT[0])
    dy *= f(-LIGHT[1])
    dx += dy
    dx += f(LIGHT[2]) * turned
    dx /= radius
    lit = np.maximum(dx, f(0.0), out=dx)
    turned /= radius
    shade = np.sqrt(turned, out=turned)
    shade *= f(1.0 - _RIM)
    shade += f(_RIM)
    shade *= f(_AMBIENT) + f(_DIFFUSE) * lit
    shade *= cover
    lit **= 8
    lit *= cover
    lit *= f(_GLOSS)
    planes *= f(1.0) - cover
    for plane, part in zip(planes, colour, strict=False):
        plane += np.minimum(f(part) * shade + lit, cover)
    planes[3] += cover
