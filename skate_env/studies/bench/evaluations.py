"""One evaluation of the accelerations: mass matrix, bias, factor, contact forces."""

import time
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from itertools import repeat

from ..._core import Simulator
from ..accuracy.mujoco_model import PYRAMIDAL, Setting
from ..timing import Block
from . import lower_bound
from .bodies import MujocoBody, PinocchioBody, alike
from .peers import Missing, package, tool
from .sizes import Extent
from .states import EVALUATED, STEP, Kind, find
from .table import OURS, Entry, Group, attempted, measure

MUJOCO, MUJOCO_SOLVED = "MuJoCo", "MuJoCo, solver at its solution"
MUJOCO_CALL, PINOCCHIO_CALL = "a call of MuJoCo", "a call of Pinocchio"
"""What calling a peer from Python takes, by itself."""
PYTHON = "Python"
FLOOR, FLOOR_NATIVE = "straight-line code", "straight-line code, this processor's"
"""The same tree as generated arithmetic; see `floor`."""

# Evaluations in a block, shared by its states.
_BLOCK = 60


def evaluations(extent: Extent) -> Group:
    """Measure evaluations in every contact state."""
    entries: list[Entry] = []
    for kind in EVALUATED:
        entries += _of(kind, find(kind, extent.states, "balanced"))
    entries += attempted(PYTHON, MUJOCO_CALL, "MuJoCo", _mujoco_call)
    entries += attempted(PYTHON, PINOCCHIO_CALL, "Pinocchio", _pinocchio_call)
    group = measure("Right-hand side", "one evaluation", entries, extent.rounds)
    group.notes = [
        "IceSkate's figures hold the torques of the scene's controller, too; peers are given them. "
        "Mass matrix and bias of all three are compared in each state before anything is timed.",
        "Peers are called from Python. What such a call takes by itself, on a model without "
        "bodies, stands below the others and has not been taken off them.",
        "MuJoCo is a step after our states, so that its solver of contact forces begins with the "
        "last step's solution, as in any simulation; at its solution it has nothing left to do. "
        "Its feet hop: states in which fewer ends touch than with us are left out.",
    ]
    return group


def _of(kind: Kind, sims: Sequence[Simulator]) -> Iterator[Entry]:
    each = max(1, _BLOCK // len(sims))
    done = each * len(sims)
    name = kind.name
    what = (
        f"Simulator.measure('rhs') in {len(sims)} states of scene {kind.scene}, "
        f"{' or '.join(kind.states)}"
    )

    def ours() -> int:
        return round(1e9 * sum(sim.measure("rhs", each) for sim in sims))

    yield Entry(name, OURS, OURS, what, ours, done, size=float(sims[0].size()["multipliers"]))
    in_flight = name == "flight"
    setting = Setting("Euler", STEP, *((None, None) if in_flight else (PYRAMIDAL, "default")))
    for label, solved in ((MUJOCO, False), *([] if in_flight else [(MUJOCO_SOLVED, True)])):

        def theirs(label: str = label, solved: bool = solved) -> Iterator[Entry]:
            bodies = alike([(sim, MujocoBody(sim, setting)) for sim in sims])
            for body in bodies if solved else ():
                body.solve()
            forward = bodies[0].mj.mj_forward
            calls = [lambda b=body: forward(b.model, b.data) for body in bodies]
            found = f"{bodies[0].contacts} contacts, pyramidal cones"
            contacts = "contacts disabled" if in_flight else found
            said = f"mj_forward in {len(bodies)} of these states, {contacts}"
            block, per = _calls(calls, each), float(each * len(bodies))
            yield Entry(name, label, tool("MuJoCo", "mujoco"), said, block, per)

        yield from attempted(name, label, "MuJoCo", theirs)

    def pinocchio() -> Iterator[Entry]:
        bodies = [PinocchioBody(sim) for sim in sims]
        aba = bodies[0].pin.aba
        calls = [lambda b=body: aba(b.model, b.data, b.q, b.v, b.torque) for body in bodies]
        said = "pinocchio.aba in the same states, no contact"
        yield Entry(name, "Pinocchio", tool("Pinocchio", "pin"), said, _calls(calls, each), done)

    if in_flight:
        yield from attempted(name, "Pinocchio", "Pinocchio", pinocchio)
        for label, flags in ((FLOOR, lower_bound.PORTABLE), (FLOOR_NATIVE, lower_bound.NATIVE)):
            yield from attempted(name, label, "CasADi", partial(_floor, name, label, flags))


def _floor(name: str, label: str, flags: Sequence[str]) -> Iterator[Entry]:
    package("casadi")
    if lack := lower_bound.missing():
        raise Missing(lack)
    code = lower_bound.Compiled(flags=flags)
    said = (
        f"forward dynamics of scene paper's tree without a controller, {code.flops.total} flops, "
        f"{code.flops.sines} sines and as many cosines; {code.compiler} {' '.join(flags)}"
    )
    yield Entry(name, label, tool("CasADi", "casadi"), said, code.block(_BLOCK), _BLOCK)


def _mujoco_call() -> Iterator[Entry]:
    mj = package("mujoco")
    model = mj.MjModel.from_xml_string("<mujoco/>")
    data = mj.MjData(model)
    block = _calls([lambda: mj.mj_energyPos(model, data)], _BLOCK)
    said = "mj_energyPos of a model without bodies"
    yield Entry(PYTHON, MUJOCO_CALL, tool("MuJoCo", "mujoco"), said, block, _BLOCK)


def _pinocchio_call() -> Iterator[Entry]:
    pin = package("pinocchio", "pin")
    model = pin.Model()
    data = model.createData()
    x = pin.utils.zero(0)
    block = _calls([lambda: pin.aba(model, data, x, x, x)], _BLOCK)
    said = "pinocchio.aba of a model without bodies"
    yield Entry(PYTHON, PINOCCHIO_CALL, tool("Pinocchio", "pin"), said, block, _BLOCK)


def _calls(calls: Sequence[Callable[[], object]], each: int) -> Block:
    """Call everything so often."""

    def block() -> int:
        before = time.perf_counter_ns()
        for call in calls:
            for _ in repeat(None, each):
                call()
        return time.perf_counter_ns() - before

    return block
