"""One step of accuracy `fast`, against MuJoCo's at the same step size and at equal errors."""

import time
from collections.abc import Iterator, Sequence
from dataclasses import replace

from ..._core import Simulator
from ..accuracy import settings, study
from ..accuracy.curves import ratios
from ..accuracy.mujoco_model import PYRAMIDAL, Setting
from ..timing import Block
from .bodies import MujocoBody, alike
from .peers import Missing, package, tool
from .sizes import Extent
from .states import STEP, STEPPED, Kind, find
from .table import OURS, Entry, Group, Row, attempted, measure

_INTEGRATORS = ("Euler", "implicitfast", "RK4")
# Our steps in a block, shared by its states, and those of each state in company.
_BLOCK, _COPIES = 60, 64
# A body that falls for so many steps reaches no speed beyond this [rad/s], [m/s].
_FALL, _FASTEST = 200, 1e3

TOGETHER = f"{OURS}, batch"
"""The label of steps that are made in company."""

MOTIONS = ("flight", "slide", "landing")
"""Motions of the accuracy study that MuJoCo can make and that are compared at equal errors."""


def steps(extent: Extent) -> Group:
    """Measure steps in flight, gliding and landing."""
    entries: list[Entry] = []
    for kind in STEPPED:
        entries += _of(kind, find(kind, extent.states, "fast"))
    title = f"Step of {1e3 * STEP:g} ms"
    group = measure(title, "one step", entries, extent.rounds)
    group.notes = [
        "IceSkate's figures are of accuracy `fast`, with controller and energy balance; landing is "
        "the step in which the free heel strikes, the impact included. Each copy of the state is put "
        "back before the clock starts; the clock's own 20 ns or so are in the figure.",
        f"`{TOGETHER}` is the time of one step of one robot where {_COPIES} go together, from the "
        "same state, in the lanes of vector registers: what a core does in a batch at its best.",
        "MuJoCo makes its second step from the same states under the same torques, held, with its "
        "default solver and contact: the first one gives the solver where to begin, and a heel "
        "that lands has struck by then. An integrator is stable where bodies that fall for "
        f"{_FALL} steps stay below {_FASTEST:g} rad/s.",
    ]
    return group


def _of(kind: Kind, sims: Sequence[Simulator]) -> Iterator[Entry]:
    yield _ours(kind, sims, OURS, "step", _BLOCK)
    # Registers are full.
    yield _ours(kind, sims, TOGETHER, "batch", _COPIES * len(sims))
    for integrator in _INTEGRATORS:
        label = f"MuJoCo, {integrator}"

        def theirs(integrator: str = integrator, label: str = label) -> Iterator[Entry]:
            name = tool("MuJoCo", "mujoco")
            setting = Setting(integrator, STEP, PYRAMIDAL, "default")
            pairs = [(sim, MujocoBody(sim, setting)) for sim in sims]
            # Where a foot lands MuJoCo's other one hops.
            bodies = [body for _, body in pairs] if kind.landing else alike(pairs)
            touch = sum(body.contacts for body in bodies) / len(bodies)
            said = (
                f"mj_step in {len(bodies)} of these states, {touch:.2g} contacts, pyramidal cones"
            )
            if not all(body.is_stable(_FALL, _FASTEST) for body in bodies):
                yield Entry(kind.name, label, name, said, reason=f"unstable at {1e3 * STEP:g} ms")
                return
            yield Entry(kind.name, label, name, said, _steps(bodies), float(len(bodies)))

        yield from attempted(kind.name, label, "MuJoCo", theirs)


def _ours(kind: Kind, sims: Sequence[Simulator], label: str, work: str, repeats: int) -> Entry:
    each = max(1, repeats // len(sims))
    what = f"Simulator.measure('{work}') in {len(sims)} states of scene {kind.scene}"

    def block() -> int:
        return round(1e9 * sum(sim.measure(work, each) for sim in sims))

    return Entry(kind.name, label, OURS, what, block, each * len(sims))


def _steps(bodies: Sequence[MujocoBody]) -> Block:
    saved = [body.saved() for body in bodies]
    step = bodies[0].mj.mj_step
    works = [(body.model, body.data) for body in bodies]

    def block() -> int:
        for body, state in zip(bodies, saved, strict=True):
            body.restore(state)
        before = time.perf_counter_ns()
        for model, data in works:
            step(model, data)
        return time.perf_counter_ns() - before

    return block


def equal_error() -> Group:
    """Compare the cheapest methods of both at equal errors, as the accuracy study does."""
    title, unit = "Equal errors", "one simulated second"
    try:
        package("mujoco")
    except Missing as missing:
        row = Row("equal error", "MuJoCo", "MuJoCo", "", reason=str(missing))
        return Group(title, unit, 0, [row])
    extent = replace(settings.quick(), solvers=(), steps=0)
    made = study.make(MOTIONS, extent)
    rows: list[Row] = []
    for case in made.cases:
        for ratio in ratios(case):
            if ratio.ours is None or ratio.theirs is None or not ratio.known:
                continue
            name = f"{case.title}, error {ratio.error:.0e}"
            best = ((OURS, OURS, ratio.ours), ("MuJoCo", tool("MuJoCo", "mujoco"), ratio.theirs))
            for label, who, one in best:
                rows.append(Row(name, label, who, one.method, one.cost, one.cost / ratio.ours.cost))
    worst = max((case.time_error for case in made.cases), default=0.0)
    note = (
        "Errors are of the coordinates at the end of a motion [rad, m]; each tool with the "
        "cheapest of its methods, interpolated between settings. Every second setting is tried; "
        "docs/accuracy.md has all of them."
    )
    return Group(title, unit, extent.rounds, rows, worst, notes=[note])
