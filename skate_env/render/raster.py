"""Shaded solids on transparent ground: tapered capsules, which are spheres swept along a line.

Every pixel's distance to a solid's outline has a closed form, which gives smooth edges, and so have
normal and depth, which give light, shade, and limbs that pass behind each other.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .view import Array, View

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
    """Colours multiplied by their opacity, and the opacity (h, w, 4), 0 to 1; and its corner."""

    rgba: Array
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
    rgba = np.zeros((high[1] - low[1], high[0] - low[0], 4), np.float32)
    nearest = np.full(rgba.shape[:2], -np.inf, np.float32)
    depths = (ends[:, :, 0] * view.scale).astype(np.float32)
    # From far to near, so that smooth edges blend with what is behind them.
    for i in np.argsort(depths.mean(axis=1), kind="stable"):
        (left, top), (right, bottom) = lows[i] - low, highs[i] - low
        if right > left and bottom > top:
            window = np.s_[top:bottom, left:right]
            columns = np.arange(lows[i, 0], highs[i, 0], dtype=np.float32) + np.float32(0.5)
            rows = np.arange(lows[i, 1], highs[i, 1], dtype=np.float32) + np.float32(0.5)
            _blend(
                rgba[window], nearest[window], columns[None, :], rows[:, None],
                centres[i], depths[i], radii[i], solids[i].colour,
            )
    return Layer(rgba, int(low[0]), int(low[1]))


def _blend(rgba, nearest, columns, rows, centres, depths, radii, colour) -> None:
    """Blend one solid into a window of the layer, which has these columns and rows."""
    (ax, ay), (bx, by) = centres
    length = float(np.hypot(bx - ax, by - ay))
    first, last = radii
    if length <= abs(first - last) + 1e-3:
        # Seen from its end: the larger sphere hides the other.
        larger = int(last > first)
        (ax, ay), first, last, length = centres[larger], radii[larger], radii[larger], 1.0
        ux, uy, taper, run = 1.0, 0.0, 0.0, 0.0
        depths = depths[[larger, larger]]
    else:
        ux, uy = (bx - ax) / length, (by - ay) / length
        taper, run = (first - last) / length, length
    f = np.float32
    x, y = columns - f(ax), rows - f(ay)
    along = f(ux) * x + f(uy) * y
    across = np.abs(f(uy) * x - f(ux) * y)
    # The sphere whose outline is nearest; its place along the axis.
    place = np.clip(along - f(taper / np.sqrt(1.0 - taper**2)) * across, f(0.0), f(run))
    radius = f(first) - f(taper) * place
    dx, dy = x - f(ux) * place, y - f(uy) * place
    distance = np.sqrt(dx * dx + dy * dy)
    cover = np.clip(radius - distance + f(0.5), f(0.0), f(1.0))
    inside = np.minimum(distance, radius)
    turned = np.sqrt(radius * radius - inside * inside)
    depth = f(depths[0]) + place * f((depths[1] - depths[0]) / length) + turned
    # Where two solids run into each other, one fades into the other.
    cover *= np.clip(f(0.5) * (depth - nearest) + f(0.5), f(0.0), f(1.0))
    np.copyto(nearest, depth, where=cover > f(0.5))
    # The normal's right, upward and viewer's part are dx, -dy, turned over the radius.
    facing = turned / radius
    lit = (f(LIGHT[0]) * dx - f(LIGHT[1]) * dy) / radius + f(LIGHT[2]) * facing
    np.maximum(lit, f(0.0), out=lit)
    shade = (f(_AMBIENT) + f(_DIFFUSE) * lit) * (f(_RIM) + f(1.0 - _RIM) * np.sqrt(facing))
    shade *= cover
    lit *= lit
    lit *= lit
    gloss = f(_GLOSS) * lit * lit * cover
    rgba *= (f(1.0) - cover)[..., None]
    for channel in range(3):
        rgba[..., channel] += np.minimum(f(colour[channel]) * shade + gloss, cover)
    rgba[..., 3] += cover
