"""The robot's bodies, regrouped for the least arithmetic of their dynamics."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from skate_env._core import Simulator

Array = NDArray[np.float64]

X = 0
# Number of coordinates before the joints (y0 and z0); q1 is the first body's joint.
BEFORE = 2


@dataclass
class Body:
    """A rigid body; moments are about its joint, in its own axes."""

    parent: int
    axis: int | None
    """Axis of its joint: 0, 1, 2 for x, y, z; None for a point fixed to the parent."""
    offset: Array
    """Position of its joint relative to the parent's [m]."""
    in_limb: bool
    """Whether it rotates about the x axis of the limb's carrier."""
    mass: float = 0.0
    """[kg]"""
    moment: Array = field(default_factory=lambda: np.zeros(3))
    """Mass times centre of mass [kg m]."""
    inertia: Array = field(default_factory=lambda: np.zeros((3, 3)))
    """[kg m2]"""
    joint: int = -1
    """Index of its joint, 0 for the first body; -1 for a point."""
    damping: float = 0.0
    """Damping of its joint [N m s/rad]."""

    def add(self, mass: float, moment: Array, inertia: Array, at: Array) -> None:
        """Add a body that is fixed to this one with its joint at a point."""
        self.mass += mass
        self.moment += moment + mass * at
        self.inertia += inertia + _tensor(at, moment) + _tensor(moment, at) + mass * _tensor(at, at)


def _tensor(a: Array, b: Array) -> Array:
    """Return (a . b) 1 - a b'; for a = b the inertia of a unit mass at a."""
    return np.asarray(a @ b * np.eye(3) - np.outer(a, b))


def tree(simulator: Simulator) -> list[Body]:
    """Return the bodies, parents first, regrouped for the least arithmetic."""
    bodies: list[Body] = []
    # Index of each of the simulator's bodies, and of the common point of its limbs.
    indices: list[int] = []
    meeting: dict[int, int] = {}
    described = simulator.bodies()
    carried = Counter(each["parent"] for each in described)
    for number, each in enumerate(described):
        host, offset = each["parent"], np.array(each["offset"])
        if host < 0:
            # Its coordinates are those of the pivot.
            parent, offset = -1, np.zeros(3)
        elif carried[host] > 1 and not bodies[indices[host]].in_limb:
            # The offset shared by shoulders and neck becomes one point.
            if host not in meeting:
                meeting[host] = len(bodies)
                middle = offset * [0.0, 1.0, 1.0]
                bodies.append(Body(indices[host], None, middle, in_limb=False))
            parent = meeting[host]
            offset = offset - bodies[parent].offset
        else:
            parent = indices[host]
        axis = "xyz".index(each["axis"])
        body = Body(parent, axis, offset, axis == X and _carries_limb(bodies, parent))
        body.add(each["mass"], np.zeros(3), each["inertia"], each["com"])
        body.joint, body.damping = number, each["damping"]
        indices.append(len(bodies))
        bodies.append(body)
    for body in reversed(bodies[1:]):
        _move_inertia(body, bodies[body.parent])
    return bodies


def _carries_limb(bodies: list[Body], parent: int) -> bool:
    return parent < 0 or bodies[parent].in_limb or bodies[parent].axis is None


def _move_inertia(body: Body, parent: Body) -> None:
    """Move inertia that a rotation about the joint does not change to the parent.

    This is the mass at the joint, the moment along the axis, and the isotropic part of the inertia
    normal to the axis.
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
