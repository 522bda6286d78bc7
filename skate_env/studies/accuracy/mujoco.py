"""The motions of the study in MuJoCo, at its best.

MuJoCo's coordinates are counted from the toe of the supporting foot, as the engine's are unless
that foot stands on its heel alone; ends are compared as the engine counts them.
"""

import math
import time
from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np

from ..._core import Simulator
from ..timing import Block
from .cases import Case
from .mujoco_model import ELLIPTIC, PYRAMIDAL, Setting, is_fixed, load, package
from .outcome import Array, Outcome

FINEST = 1e-2 / 2**11
"""Timestep of the limit [s]; half the finest one of `settings`."""

# Coordinates before the joints: y0, z0, q1.
_ROOT = 3
# The supporting foot's row of `Simulator.link_segments`.
_FOOT = 0
# A motion is looked at so often, whether it is sound and how deep a foot sinks [s].
_LOOK = 0.005
# A block has so many evaluations of the dynamics at most, in so many parts of the motion.
_EVALUATIONS, _PARTS = 120, 10


# Integrator, cone, contact.
_Method = tuple[str, str | None, str | None]
_SMOOTH: tuple[_Method, ...] = (
    ("Euler", None, None),
    ("implicitfast", None, None),
    ("implicit", None, None),
    ("RK4", None, None),
)
_TOUCHING: dict[str, tuple[_Method, ...]] = {
    "slide": (
        ("Euler", PYRAMIDAL, "default"),
        ("implicitfast", ELLIPTIC, "default"),
        ("Euler", PYRAMIDAL, "stiff"),
        ("Euler", ELLIPTIC, "gliding coarse"),
        ("Euler", ELLIPTIC, "gliding"),
        ("Euler", ELLIPTIC, "gliding fine"),
        ("implicitfast", ELLIPTIC, "gliding fine"),
        ("RK4", ELLIPTIC, "gliding fine"),
    ),
    "landing": (
        ("Euler", PYRAMIDAL, "default"),
        ("implicitfast", ELLIPTIC, "default"),
        ("Euler", PYRAMIDAL, "stiff"),
        ("RK4", ELLIPTIC, "stiff"),
        ("Euler", ELLIPTIC, "firm"),
        ("implicitfast", ELLIPTIC, "firm"),
        ("RK4", ELLIPTIC, "firm"),
    ),
}
# Coarsest timestep [s], and how many times it is halved. One of them is 1.56 ms: RK4 is stable on
# `swing` up to 1.8 ms, and there it is cheapest.
_SMOOTH_STEPS, _TOUCHING_STEPS = (0.05, 9), (0.01, 10)


def settings(case: Case, quick: bool = False) -> list[Setting]:
    """List what to run, coarse to fine within a method; every second timestep where it is quick."""
    methods = _SMOOTH if case.smooth else _TOUCHING[case.name]
    coarsest, halvings = _SMOOTH_STEPS if case.smooth else _TOUCHING_STEPS
    steps = [coarsest / 2**k for k in range(0, halvings + 1, 2 if quick else 1)]
    return [Setting(how, step, cone, touch) for how, cone, touch in methods for step in steps]


def run(case: Case, setting: Setting, start: int) -> Outcome:
    """Compute a motion; `termination` is `not_finite` where MuJoCo gave up.

    The foot slides under the coefficient of its direction: MuJoCo knows one for both, which is
    rewritten before every step from the velocity of the end of the sole that is lower.
    """
    motion = Motion(case, setting, start)
    steps = round(case.duration / setting.timestep)
    look = max(1, round(_LOOK / setting.timestep))
    penetration, done = 0.0, 0
    with _quiet():
        while done < steps and motion.is_sound():
            motion.advance(min(look, steps - done))
            done += min(look, steps - done)
            penetration = max(penetration, motion.penetration())
    q, v = motion.state()
    return Outcome(
        time=done * setting.timestep,
        termination=None if motion.is_sound() else "not_finite",
        q=q,
        v=v,
        states=(),
        event_times=(),
        slide=float(q[0] - motion.begun[0]),
        energy_residual=None,
        drift=None,
        penetration=None if case.smooth else penetration,
        pull=None,
        cone_excess=None,
        stats={"steps": float(done)},
    )


def limit(case: Case, cone: str | None, contact: str | None, start: int = 0) -> Outcome:
    """Compute a motion at the finest timestep, for the distance of a contact to its own limit.

    `default` is the same soft contact at every timestep, and has its own limit; the others become
    rigid, and theirs is the engine's motion. RK4, because some hop under Euler at this timestep.
    """
    return run(case, Setting("RK4", FINEST, cone, contact), start)


def block(case: Case, setting: Setting) -> tuple[Block, float]:
    """Make a block of MuJoCo's steps, and say how much of the motion they are [s].

    Where the whole motion is too long, the block is parts of it that are as far from each other,
    and goes back to the state before each of them, which is not timed. Nor is the rewriting of
    friction: a part keeps the coefficient it begins with.
    """
    mj = package()
    motion = Motion(case, setting, 0)
    steps = round(case.duration / setting.timestep)
    most = _EVALUATIONS // (4 if setting.integrator == "RK4" else 1)
    parts = 1 if steps <= most else _PARTS
    each = min(steps, most) // parts
    spec = mj.mjtState.mjSTATE_INTEGRATION
    saved = []
    with _quiet():
        for part in range(parts):
            motion.advance(part * steps // parts - motion.steps)
            state = np.empty(mj.mj_stateSize(motion.model, spec))
            mj.mj_getState(motion.model, motion.data, state, spec)
            saved.append((state, motion.friction))
    model, data = motion.model, motion.data

    def work() -> int:
        spent = 0
        with _quiet():
            for state, friction in saved:
                mj.mj_setState(model, data, state, spec)
                motion.friction = friction
                before = time.perf_counter_ns()
                mj.mj_step(model, data, nstep=each)
                spent += time.perf_counter_ns() - before
        return spent

    return work, parts * each * setting.timestep


class Motion:
    """A case under way."""

    def __init__(self, case: Case, setting: Setting, start: int) -> None:
        self.mj = package()
        self.model = load(case, setting)
        self.data = self.mj.MjData(self.model)
        self.steps = 0
        sim = Simulator(case.scene)
        sim.reset(*case.start(start))
        self.begun = sim.q
        self._case, self._start = case, start
        self._length = float(np.ptp(sim.link_segments(np.zeros_like(sim.q))[_FOOT, :, 1]))
        # What MuJoCo's model has no joints for keeps its value.
        self._held = _ROOT if is_fixed(case) else 0
        q, v = move_pivot(sim.q, sim.v, self._length if stands_on_heel(sim) else 0.0)
        self._root = q[: self._held], v[: self._held]
        self.data.qpos[:], self.data.qvel[:] = q[self._held :], v[self._held :]
        if case.torque is not None:
            self.data.qfrc_applied[_ROOT - self._held :] = case.torque
        friction = [f"ice.friction.mu_{way}" for way in ("forward", "backward")]
        numbers = case.scene.parameters()
        self._mu = [numbers[name][0] for name in friction if name in numbers]
        self._rewrites = not case.smooth and len(self._mu) == 2

    @property
    def friction(self) -> float | None:
        """Coefficient along the ice."""
        return float(self.model.pair_friction[0, 0]) if self.model.npair else None

    @friction.setter
    def friction(self, value: float | None) -> None:
        if value is not None:
            self.model.pair_friction[:, :2] = value

    def advance(self, steps: int) -> None:
        """Make steps."""
        self.steps += steps
        if not self._rewrites:
            if steps:
                self.mj.mj_step(self.model, self.data, nstep=steps)
            return
        forward, backward = self._mu
        q, v, length = self.data.qpos, self.data.qvel, self._length
        friction = self.model.pair_friction[:, :2]
        present = None
        for _ in range(steps):
            along = v[0] + max(0.0, math.sin(q[2])) * length * v[2]
            if (mu := forward if along >= 0.0 else backward) != present:
                friction[:] = present = mu
            self.mj.mj_step(self.model, self.data)

    def is_sound(self) -> bool:
        """Say whether MuJoCo never found numbers too large for it; it would start again."""
        kinds = self.mj.mjtWarning
        bad = (kinds.mjWARN_BADQPOS, kinds.mjWARN_BADQVEL, kinds.mjWARN_BADQACC)
        return not any(self.data.warning[int(kind)].number for kind in bad)

    def penetration(self) -> float:
        """How deep the lower end of the supporting sole is below the ice [m]."""
        if self._held:
            return 0.0
        toe, angle = self.data.qpos[1], self.data.qpos[2]
        return max(0.0, -float(toe - max(0.0, math.sin(angle)) * self._length))

    def state(self) -> tuple[Array, Array]:
        """Give q and v (n,), counted from the pivot that the engine ends with."""
        q = np.concatenate([self._root[0], self.data.qpos])
        v = np.concatenate([self._root[1], self.data.qvel])
        if _ends_on_heel(self._case, self._start):
            return move_pivot(q, v, -self._length)
        return q, v


def move_pivot(q: Array, v: Array, along: float) -> tuple[Array, Array]:
    """Count the same motion from another point of the sole, so far in front of the pivot [m]."""
    q, v = q.copy(), v.copy()
    sine, cosine = math.sin(q[2]), math.cos(q[2])
    q[:2] += along * cosine, along * sine
    v[:2] += -along * sine * v[2], along * cosine * v[2]
    return q, v


def stands_on_heel(sim: Simulator) -> bool:
    """Say whether the pivot is the heel; MuJoCo's is always the toe."""
    heel, toe = sim.link_segments()[_FOOT, :, 1:]
    return bool(np.linalg.norm(heel - sim.q[:2]) < np.linalg.norm(toe - sim.q[:2]))


@contextmanager
def _quiet() -> Iterator[None]:
    """Keep MuJoCo's warnings from the terminal and from its log file; `run` looks at them."""
    mj = package()
    before = mj.get_mju_user_warning()
    mj.set_mju_user_warning(lambda message: None)
    try:
        yield
    finally:
        mj.set_mju_user_warning(before)


def _ends_on_heel(case: Case, start: int) -> bool:
    """Say whether the engine's motion ends with the heel as its pivot."""
    if case.smooth:
        return False
    period = {"control.action_period": case.duration}
    sim = Simulator(case.with_accuracy(1e-6).with_values(period))
    sim.reset(*case.start(start))
    sim.step(case.torque)
    return stands_on_heel(sim)
