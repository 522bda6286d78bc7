"""The robot's bodies, regrouped so that their dynamics take the least arithmetic."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from ..._core import Simulator

Array = NDArray[np.float64]

X = 0
# Coordinates before the joints', of which the first body's is q1: y0 and z0.
BEFORE = 2


@dataclass
class Body:
    """A rigid body; moments are about its joint, all in its own axes."""

    parent: int
    axis: int | None
    """Of its joint: 0, 1, 2 for x, y, z; None for a point of the parent."""
    offset: Array
    """Of its joint from the parent's [m]."""
    in_limb: bool
    """It turns about its carrier's x axis."""
    mass: float = 0.0
    """[kg]"""
    moment: Array = field(default_factory=lambda: np.zeros(3))
    """Mass times centre of mass [kg m]."""
    inertia: Array = field(default_factory=lambda: np.zeros((3, 3)))
    """[kg m2]"""
    joint: int = -1
    """Number of its joint, that of the first body being 0; a point has none."""
    damping: float = 0.0
    """Of its joint [N m s/rad]."""

    def add(self, mass: float, moment: Array, inertia: Array, at: Array) -> None:
        """Fix a body to this one whose joint lies at a point."""
        self.mass += mass
        self.moment += moment + mass * at
        self.inertia += inertia + _tensor(at, moment) + _tensor(moment, at) + mass * _tensor(at, at)


def _tensor(a: Array, b: Array) -> Array:
    """For a = b the inertia of a unit mass there."""
    return np.asarray(a @ b * np.eye(3) - np.outer(a, b))


def tree(simulator: Simulator) -> list[Body]:
    """Read the bodies, parents first, regrouped for the least arithmetic."""
    bodies: list[Body] = []
    # Where each of the simulator's bodies is, and the point its limbs meet in.
    places: list[int] = []
    meeting: dict[int, int] = {}
    described = simulator.bodies()
    carried = Counter(each["parent"] for each in described)
    for number, each in enumerate(described):
        host, offset = each["parent"], np.array(each["offset"])
        if host < 0:
            # Its coordinates are those of the pivot.
            parent, offset = -1, np.zeros(3)
        elif carried[host] > 1 and not bodies[places[host]].in_limb:
            # Shoulders and neck are side by side: what they share is moved down once.
            if host not in meeting:
                meeting[host] = len(bodies)
                middle = offset * [0.0, 1.0, 1.0]
                bodies.append(Body(places[host], None, middle, in_limb=False))
            parent = meeting[host]
            offset = offset - bodies[parent].offset
        else:
            parent = places[host]
        axis = "xyz".index(each["axis"])
        body = Body(parent, axis, offset, axis == X and _holds_a_limb(bodies, parent))
        body.add(each["mass"], np.zeros(3), each["inertia"], each["com"])
        body.joint, body.damping = number, each["damping"]
        places.append(len(bodies))
        bodies.append(body)
    for body in reversed(bodies[1:]):
        _hand_on(body, bodies[body.parent])
    return bodies


def _holds_a_limb(bodies: list[Body], parent: int) -> bool:
    return parent < 0 or bodies[parent].in_limb or bodies[parent].axis is None


def _hand_on(body: Body, parent: Body) -> None:
    """Count as the parent's what turning about the joint does not move.

    That is the mass as if at the joint, the moment along the axis, and as much inertia as is the
    same about all directions across the axis.
    """
    mass, moment, inertia = body.mass, np.array(body.moment), np.array(body.inertia)
    if body.axis is not None:
        along = np.eye(3)[body.axis]
        moment = moment * along
        inertia = body.inertia[body.axis - 1, body.axis - 1] * (np.eye(3) - np.diag(along))
    body.mass = 0.0
    body.moment -= moment
    body.inertia -= inertia
    parent.add(mass, moment, inertia, body.offset)
