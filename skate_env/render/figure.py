"""Solids of the robot as a person with limbs, head and skates."""

import numpy as np
from numpy.typing import NDArray

from .raster import Solid

Vector = NDArray[np.float64]
Colour = tuple[float, float, float]


def _rgb(text: str) -> Colour:
    red, green, blue = (int(text[i : i + 2], 16) / 255 for i in (1, 3, 5))
    return red, green, blue


# Palette of Okabe and Ito, suitable for colour-blind readers; as in `skate_env.replay.figures`.
SUPPORT, FREE = "#D55E00", "#0072B2"
_JACKET, _SLEEVE, _SKIN, _HELMET, _VISOR = map(
    _rgb, ("#3B4657", "#5D6A7E", "#F1E3D3", "#F4F6F8", "#1E2530")
)
_BOOT, _STEEL = _rgb("#262C36"), _rgb("#9AA7B4")
# The far limbs fade towards this colour.
_HAZE, _HAZE_SHARE = np.array(_rgb("#F4F8FC")), 0.26
# Rows of `Simulator.link_segments`, the paper's link number minus one.
_WAIST, _LOWER, _UPPER, _HEAD = 3, 7, 9, 16
_RIGHT_ARM, _LEFT_ARM = (10, 11, 12), (13, 14, 15)


def solids(links: NDArray[np.float64], support_leg: str) -> list[Solid]:
    """Return the solids of a robot from its links (17, 2, 3) [m] and supporting leg."""
    return [
        *_trunk(links),
        *_head(links),
        *_arm(links[list(_RIGHT_ARM)], 0.0),
        *_arm(links[list(_LEFT_ARM)], 1.0),
        *_leg(links[[0, 1, 2]], (0, 1), SUPPORT, float(support_leg != "right")),
        *_leg(links[[6, 5, 4]], (1, 0), FREE, float(support_leg == "right")),
    ]


def _trunk(links: NDArray[np.float64]) -> list[Solid]:
    hips, shoulders = links[_WAIST], links[[_RIGHT_ARM[0], _LEFT_ARM[0]], 0]
    loin, chest, neck = links[_LOWER, 0], links[_UPPER, 0], links[_UPPER, 1]
    middle = shoulders.mean(axis=0)
    inward = 0.35
    return [
        Solid(
            hips[0] + 0.2 * (hips[1] - hips[0]),
            hips[1] + 0.2 * (hips[0] - hips[1]),
            (0.1, 0.1),
            _JACKET,
        ),
        Solid(loin, chest, (0.105, 0.098), _JACKET),
        Solid(chest, chest + 0.72 * (neck - chest), (0.098, 0.132), _JACKET),
        Solid(
            shoulders[0] + inward * (middle - shoulders[0]) - 0.035 * _unit(neck - chest),
            shoulders[1] + inward * (middle - shoulders[1]) - 0.035 * _unit(neck - chest),
            (0.072, 0.072),
            _JACKET,
        ),
    ]


def _head(links: NDArray[np.float64]) -> list[Solid]:
    neck, top = links[_HEAD]
    up = _unit(top - neck)
    side = _unit(links[_RIGHT_ARM[0], 0] - links[_LEFT_ARM[0], 0])
    ahead = np.cross(up, side)
    skull = top - 0.098 * up
    goggles = skull + 0.050 * ahead - 0.022 * up
    return [
        Solid(neck - 0.02 * up, neck + 0.08 * up, (0.052, 0.046), _SKIN),
        Solid(neck + 0.085 * up + 0.03 * ahead, skull, (0.06, 0.09), _SKIN),
        Solid(skull - 0.012 * ahead, skull, (0.098, 0.098), _HELMET),
        Solid(goggles - 0.055 * side, goggles + 0.055 * side, (0.052, 0.052), _VISOR),
    ]


def _arm(links: NDArray[np.float64], far: float) -> list[Solid]:
    upper, lower, hand = links
    fist = hand[0] + 0.62 * (hand[1] - hand[0])
    return [
        Solid(upper[0], upper[1], (0.06, 0.045), _faded(_SLEEVE, far)),
        Solid(lower[0], lower[1], (0.045, 0.035), _faded(_SLEEVE, far)),
        Solid(hand[0], fist, (0.036, 0.034), _faded(_SKIN, far)),
    ]


def _leg(
    links: NDArray[np.float64], ankle_end: tuple[int, int], hue: str, far: float
) -> list[Solid]:
    """Return a leg from foot, shank and thigh; `ankle_end` indexes a link's lower and upper end."""
    sole, shank, thigh = links
    lower, upper = ankle_end
    ankle, knee, hip = shank[lower], shank[upper], thigh[upper]
    colour = _faded(_rgb(hue), far)
    along = _unit(sole[1] - sole[0])
    foot = sole[0] + np.dot(ankle - sole[0], along) * along
    up = _unit(ankle - foot)
    behind, before = np.dot(foot - sole[0], along), np.dot(sole[1] - foot, along)
    heel = foot - min(0.6 * behind, 0.07) * along + 0.058 * up
    toe = foot + min(0.75 * before, 0.17) * along + 0.046 * up
    edge = 0.010 * up
    boot, steel = _faded(_BOOT, far), _faded(_STEEL, far)
    return [
        Solid(hip, knee, (0.088, 0.060), colour),
        Solid(knee, ankle, (0.060, 0.042), colour),
        Solid(ankle + 0.02 * up, ankle + 0.055 * up, (0.05, 0.05), boot),
        Solid(heel, toe, (0.038, 0.028), boot),
        Solid(sole[0] + edge, sole[1] + edge, (0.010, 0.010), steel),
        Solid(heel, heel - 0.05 * up, (0.012, 0.012), steel),
        Solid(toe, toe - 0.038 * up, (0.012, 0.012), steel),
    ]


def _faded(colour: Colour, far: float) -> Colour:
    red, green, blue = (1.0 - far * _HAZE_SHARE) * np.array(colour) + far * _HAZE_SHARE * _HAZE
    return float(red), float(green), float(blue)


def _unit(vector: Vector) -> Vector:
    unit: Vector = vector / max(float(np.linalg.norm(vector)), 1e-12)
    return unit
