"""One evaluation of the accelerations: mass matrix, bias forces, factorisation, contact forces."""

from collections.abc import Callable, Iterator, Sequence
from itertools import repeat

from skate_env._core import Simulator
from skate_env.studies import timing
from skate_env.studies.fixtures import name_of
from skate_env.studies.motions.mujoco_model import PYRAMIDAL, Setting
from skate_env.studies.timing import Block

from .bodies import MujocoBody, PinocchioBody, with_equal_contacts
from .peers import package, tool
from .sizes import Sizes
from .states import EVALUATED, STEP, Kind, find
from .table import OURS, Entry, Group, attempted, measure

MUJOCO, MUJOCO_SOLVED = "MuJoCo", "MuJoCo, solver at its solution"
MUJOCO_CALL, PINOCCHIO_CALL = "a call of MuJoCo", "a call of Pinocchio"
"""Calls from Python that do nothing, which measure the overhead of a call."""
PYTHON = "Python"

# Evaluations in a block, over all its states.
_BLOCK = 60


def evaluations(sizes: Sizes) -> Group:
    """Measure evaluations in every contact state."""
    entries: list[Entry] = []
    for kind in EVALUATED:
        entries += _of(kind, find(kind, sizes.states, "balanced"))
    entries += attempted(PYTHON, MUJOCO_CALL, "MuJoCo", _mujoco_call)
    entries += attempted(PYTHON, PINOCCHIO_CALL, "Pinocchio", _pinocchio_call)
    group = measure("Right-hand side", "one evaluation", entries, sizes.rounds)
    group.notes = [
        "IceSkate's times include the torques of the scene's controller; the others get them as "
        "input. Mass matrices and bias forces of all three are compared in each state first.",
        "MuJoCo and Pinocchio are called from Python. The last rows give the time of such a call "
        "on a model without bodies; it is not subtracted in this table.",
        "MuJoCo is evaluated one step after IceSkate's states, so that its contact solver starts "
        "from the last step's solution, as in any simulation. In the rows `solver at its "
        "solution` it starts from the present solution. Its feet bounce: states with fewer "
        "contacts than in IceSkate are left out.",
    ]
    return group


def _of(kind: Kind, sims: Sequence[Simulator]) -> Iterator[Entry]:
    each = max(1, _BLOCK // len(sims))
    done = each * len(sims)
    name = kind.name
    what = (
        f"Simulator.measure('rhs') in {len(sims)} states of scene {name_of(kind.scene)}, "
        f"{' or '.join(kind.states)}"
    )
    ours = timing.inside(sims, "rhs", each)
    yield Entry(name, OURS, OURS, what, ours, done, size=float(sims[0].size()["multipliers"]))
    in_flight = name == "flight"
    setting = Setting("Euler", STEP, *((None, None) if in_flight else (PYRAMIDAL, "default")))
    for label, solved in ((MUJOCO, False), *([] if in_flight else [(MUJOCO_SOLVED, True)])):

        def theirs(label: str = label, solved: bool = solved) -> Iterator[Entry]:
            bodies = with_equal_contacts([(sim, MujocoBody(sim, setting)) for sim in sims])
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
    """Return a block that makes each of the calls `each` times."""

    def work() -> None:
        for call in calls:
            for _ in repeat(None, each):
                call()

    return timing.timed(work)
