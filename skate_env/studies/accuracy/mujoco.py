"""The motions of the study in MuJoCo, with its best settings.

MuJoCo's root coordinates are those of the supporting toe. The engine's are those of the toe, or of
the heel if the foot stands on its heel alone. Results are converted to the engine's.
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
"""Timestep of `limit` [s]: half the finest one of `settings`."""

# Coordinates before the joints: y0, z0, q1.
_ROOT = 3
# Row of the supporting foot in `Simulator.link_segments`.
_FOOT = 0
# Sample period of warnings and penetration [s].
_SAMPLE_PERIOD = 0.005
# A block has at most `_EVALUATIONS` evaluations of the dynamics, in `_PARTS` parts of the motion.
_EVALUATIONS, _PARTS = 120, 10


# Integrator, cone, contact.
_Method = tuple[str, str | None, str | None]
_SMOOTH: tuple[_Method, ...] = (
    ("Euler", None, None),
    ("implicitfast", None, None),
    ("implicit", None, None),
    ("RK4", None, None),
)
_CONTACT: dict[str, tuple[_Method, ...]] = {
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
# Coarsest timestep [s] and number of halvings. 1.56 ms is one of them: RK4 is stable on `swing` up
# to 1.8 ms, where it is cheapest.
_SMOOTH_STEPS, _CONTACT_STEPS = (0.05, 9), (0.01, 10)


def settings(case: Case, quick: bool = False) -> list[Setting]:
    """Return the settings, coarse to fine within a method; every second timestep if `quick`."""
    methods = _SMOOTH if case.smooth else _CONTACT[case.name]
    coarsest, halvings = _SMOOTH_STEPS if case.smooth else _CONTACT_STEPS
    steps = [coarsest / 2**k for k in range(0, halvings + 1, 2 if quick else 1)]
    return [Setting(how, step, cone, contact) for how, cone, contact in methods for step in steps]


def run(case: Case, setting: Setting, start: int) -> Outcome:
    """Compute a motion; `termination` is `not_finite` if MuJoCo reports bad values.

    MuJoCo has one friction coefficient for both sliding directions. It is rewritten before every
    step for the present direction, that of the lower end of the sole.
    """
    motion = Motion(case, setting, start)
    steps = round(case.duration / setting.timestep)
    period = max(1, round(_SAMPLE_PERIOD / setting.timestep))
    penetration, done = 0.0, 0
    with _quiet():
        while done < steps and motion.is_valid():
            motion.advance(min(period, steps - done))
            done += min(period, steps - done)
            penetration = max(penetration, motion.penetration())
    q, v = motion.state()
    return Outcome(
        time=done * setting.timestep,
        termination=None if motion.is_valid() else "not_finite",
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
    """Compute a motion at the finest timestep: the limit of a soft contact.

    The contact `default` is equally soft at every timestep and has a limit of its own. The others
    become rigid, and their limit is the engine's motion. The integrator is RK4, because some
    contacts bounce with Euler at this timestep.
    """
    return run(case, Setting("RK4", FINEST, cone, contact), start)


def block(case: Case, setting: Setting) -> tuple[Block, float]:
    """Return a block that times MuJoCo's steps, and the simulated time of these steps [s].

    If the motion is too long, the block consists of equally spaced parts of it. Restoring the state
    before each part is not timed. A part keeps the friction coefficient of its start.
    """
    mj = package()
    motion = Motion(case, setting, 0)
    steps = round(case.duration / setting.timestep)
    most = _EVALUATIONS // (4 if setting.integrator == "RK4" else 1)
    parts = 1 if steps <= most else _PARTS
    length = min(steps, most) // parts
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
                mj.mj_step(model, data, nstep=length)
                spent += time.perf_counter_ns() - before
        return spent

    return work, parts * length * setting.timestep


class Motion:
    """A motion of a case in MuJoCo."""

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
        # Coordinates without a joint in MuJoCo's model keep their values.
        self._fixed = _ROOT if is_fixed(case) else 0
        q, v = move_pivot(sim.q, sim.v, self._length if stands_on_heel(sim) else 0.0)
        self._root = q[: self._fixed], v[: self._fixed]
        self.data.qpos[:], self.data.qvel[:] = q[self._fixed :], v[self._fixed :]
        if case.torque is not None:
            self.data.qfrc_applied[_ROOT - self._fixed :] = case.torque
        friction = [f"ice.friction.mu_{way}" for way in ("forward", "backward")]
        numbers = case.scene.parameters()
        self._mu = [numbers[name][0] for name in friction if name in numbers]
        self._rewrites = not case.smooth and len(self._mu) == 2

    @property
    def friction(self) -> float | None:
        """Friction coefficient of the sole's contacts; None without contacts."""
        return float(self.model.pair_friction[0, 0]) if self.model.npair else None

    @friction.setter
    def friction(self, value: float | None) -> None:
        if value is not None:
            self.model.pair_friction[:, :2] = value

    def advance(self, steps: int) -> None:
        """Make `steps` steps of the timestep."""
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

    def is_valid(self) -> bool:
        """Whether MuJoCo has reported no bad values; after a report it resets the state."""
        kinds = self.mj.mjtWarning
        bad = (kinds.mjWARN_BADQPOS, kinds.mjWARN_BADQVEL, kinds.mjWARN_BADQACC)
        return not any(self.data.warning[int(kind)].number for kind in bad)

    def penetration(self) -> float:
        """Depth of the lower end of the supporting sole below the ice [m]."""
        if self._fixed:
            return 0.0
        toe, angle = self.data.qpos[1], self.data.qpos[2]
        return max(0.0, -float(toe - max(0.0, math.sin(angle)) * self._length))

    def state(self) -> tuple[Array, Array]:
        """Return q and v (n,), with the pivot that the engine's motion ends with."""
        q = np.concatenate([self._root[0], self.data.qpos])
        v = np.concatenate([self._root[1], self.data.qvel])
        if _ends_on_heel(self._case, self._start):
            return move_pivot(q, v, -self._length)
        return q, v


def move_pivot(q: Array, v: Array, along: float) -> tuple[Array, Array]:
    """Convert q and v to a pivot that is `along` [m] in front of the present one."""
    q, v = q.copy(), v.copy()
    sine, cosine = math.sin(q[2]), math.cos(q[2])
    q[:2] += along * cosine, along * sine
    v[:2] += -along * sine * v[2], along * cosine * v[2]
    return q, v


def stands_on_heel(sim: Simulator) -> bool:
    """Whether the pivot is the heel; MuJoCo's is always the toe."""
    heel, toe = sim.link_segments()[_FOOT, :, 1:]
    return bool(np.linalg.norm(heel - sim.q[:2]) < np.linalg.norm(toe - sim.q[:2]))


@contextmanager
def _quiet() -> Iterator[None]:
    """Suppress MuJoCo's warnings on the terminal and in its log file; `run` reads them."""
    mj = package()
    before = mj.get_mju_user_warning()
    mj.set_mju_user_warning(lambda message: None)
    try:
        yield
    finally:
        mj.set_mju_user_warning(before)


def _ends_on_heel(case: Case, start: int) -> bool:
    """Whether the engine's motion ends with the heel as its pivot."""
    if case.smooth:
        return False
    period = {"control.action_period": case.duration}
    sim = Simulator(case.with_accuracy(1e-6).with_values(period))
    sim.reset(*case.start(start))
    sim.step(case.torque)
    return stands_on_heel(sim)
