"""The motions of the study, from smooth to stiff with many events.

Every case is a scene, a duration and constant torques. Its starts differ slightly in their
velocities. Events then lie at different positions within the steps of a method, and its error is
averaged over these positions.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..._core import Scene, Simulator
from ...scenes import load_scene, replace
from ..fixtures import PAPER_DAMPED

Array = NDArray[np.float64]

STARTS = 12
"""Number of starts of a case with events."""
_SPREAD = 1e-3
# Coordinates before the joints: y0, z0, q1.
_ROOT = 3


@dataclass(frozen=True)
class Case:
    """A motion that can be computed at any accuracy."""

    name: str
    title: str
    """Description in one line."""
    scene: Scene
    duration: float
    """[s]"""
    torque: Array | None = None
    """Constant joint torques (n - 3,) [N m]."""
    smooth: bool = False
    """The motion has no events."""
    in_mujoco: bool = False
    """MuJoCo can simulate the same motion: there is no controller."""

    def with_accuracy(self, accuracy: Any) -> Scene:
        """Copy the scene with another accuracy: a name, a tolerance, or a table with a method."""
        return replace(self.scene, {"accuracy": accuracy})

    def start(self, number: int) -> tuple[Array, Array]:
        """Return coordinates and rates (n,) of a start; number 0 is the start of the scene."""
        given = self.scene.get("start")
        names = Simulator(self.scene).coordinate_names
        q, v = (np.array([given[x].get(name, 0.0) for name in names]) for x in "qv")
        if number > 0:
            rng = np.random.default_rng(number)
            v[_ROOT:] += _SPREAD * rng.standard_normal(len(v) - _ROOT)
            v[0] *= 1.0 + _SPREAD * rng.standard_normal()
        return q, v


def cases() -> dict[str, Case]:
    """All cases by name, the smooth ones first."""
    return {case.name: case for case in (make() for make in _CASES)}


_STANCE = {"q2": 0.1, "q3": -0.2, "q4": 0.15, "q5": 0.5, "q6": -0.9, "q7": 0.4}
_UPPER = [f"q{i}" for i in range(8, 18)]


def _scene(changes: dict[str, Any]) -> Scene:
    """Build a scene with the paper's body on its ice, without controller or fall detection."""
    paper = load_scene("paper_printed")
    bare = {
        "provenance": "accuracy study",
        "control.lifting": None,
        "control.feedforward": None,
        "fall": None,
        "start": {"support_leg": "right", "q": {}, "v": {}},
        "body.foot.toe": 0.18,
        "body.foot.heel": 0.10,
    }
    return replace(paper, bare | changes)


def _swing() -> Case:
    scene = _scene(
        {
            "name": "swing",
            "description": "The foot is fixed; the other bodies swing under gravity.",
            "ice.friction": {"kind": "sticking"},
            "contact.foot_rotation": False,
            "contact.free_foot": False,
            "start.q": _STANCE | {"q9": 0.1, "q11": 0.5, "q12": 0.3, "q14": -0.4},
            "start.v": {"q2": 0.5, "q5": 2.0, "q6": -3.0, "q8": 1.0, "q10": 0.5, "q11": -2.0},
        }
    )
    return Case("swing", "swing about a fixed foot", scene, 0.4, smooth=True, in_mujoco=True)


def _flight() -> Case:
    scene = _scene(
        {
            "name": "flight",
            "description": "Free flight without damping: energy and momenta are exact.",
            "contact.law": "push_only",
            "contact.toe_contact": False,
            "body.joint_damping": False,
            "start.q": _STANCE | {"z0": 1.0, "q9": 0.1, "q11": 0.5, "q12": 0.3, "q14": -0.4},
            "start.v": {"y0": 2.0, "z0": 1.0, "q1": 0.5, "q2": -1.0, "q5": 3.0, "q6": -2.0}
            | {"q8": 1.0, "q10": 0.5, "q11": 3.0, "q15": 4.0},
        }
    )
    return Case("flight", "flight without damping", scene, 0.4, smooth=True, in_mujoco=True)


def _slide() -> Case:
    scene = _scene(
        {
            "name": "slide",
            "description": "A body with constant joint angles slides to rest.",
            "ice.friction.capture_speed": 0.0,
            "locked": _UPPER,
            # The body leans back, so that heel and toe stay loaded during the deceleration.
            "start.q": {"q2": 0.12, "q5": 0.5, "q6": -0.8, "q7": 0.3},
            "start.v": {"y0": 1.0},
        }
    )
    # Inverse dynamics of the deceleration with constant joint angles.
    sim = Simulator(scene)
    slowing = np.zeros(len(sim.q))
    slowing[0] = -scene.parameters()["ice.friction.mu_forward"][0] * 9.81
    torque = sim.mass_matrix(sim.q) @ slowing + sim.bias_forces(sim.q, np.zeros_like(sim.q))
    return Case("slide", "sliding to rest", scene, 0.55, torque=torque[_ROOT:], in_mujoco=True)


def _landing() -> Case:
    scene = _scene(
        {
            "name": "landing",
            "description": "A foot lands on its heel, rolls flat, and slides.",
            # Capture would change the final state by 7e-6 rad.
            "ice.friction.capture_speed": 0.0,
            "contact.law": "push_only",
            "contact.toe_contact": False,
            # The heel starts at 0.01 m.
            "start.q": _STANCE | {"z0": 0.01 + 0.28 * np.sin(0.12), "q1": 0.12},
            "start.v": {"y0": 1.0, "z0": -0.3},
        }
    )
    return Case("landing", "landing on the heel", scene, 0.15, in_mujoco=True)


def _heel_strike() -> Case:
    return Case("heel_strike", "the paper's free heel lands", load_scene("paper_printed"), 0.25)


def _push_off() -> Case:
    scene = load_scene(PAPER_DAMPED)
    return Case("push_off", "paper_damped: land, roll, push off, leg swap", scene, 0.45)


def _cycle() -> Case:
    return Case(
        "cycle", "one cycle of the gait of paper_printed", load_scene("paper_printed"), 1.15
    )


def _stiff() -> Case:
    paper = load_scene("paper_printed")
    numbers = {name: value for name, (value, *_) in paper.parameters().items()}
    stiff = {
        name: 10.0 * x
        for name, x in numbers.items()
        if name.startswith("body") and "damping" in name
    }
    stiff |= {
        f"control.lifting.K_p.{i}": 100.0 * numbers[f"control.lifting.K_p.{i}"] for i in range(3)
    }
    scene = paper.with_values(stiff)
    return Case("stiff", "ten times the damping, a hundred times K_p", scene, 0.3)


def _push_only() -> Case:
    scene = load_scene("push_only")
    return Case("push_only", "push-only contact: roll, stick, slip, lift off", scene, 0.3)


_CASES: tuple[Callable[[], Case], ...] = (
    _swing,
    _flight,
    _slide,
    _landing,
    _heel_strike,
    _push_off,
    _cycle,
    _push_only,
    _stiff,
)
