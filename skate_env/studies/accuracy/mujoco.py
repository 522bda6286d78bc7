"""The motions of the study in MuJoCo, with its best settings."""

import time
from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np

from ..motions.cases import Case
from ..motions.mujoco_model import ELLIPTIC, PYRAMIDAL, Setting, package
from ..motions.mujoco_motion import Motion
from ..timing import Block
from .outcome import Outcome

FINEST = 1e-2 / 2**11
"""Timestep of `limit` [s]: half the finest one of `settings`."""

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
        penetration=None if case.smooth else penetration,
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
