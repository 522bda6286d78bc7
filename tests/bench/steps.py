"""One step of accuracy `fast` and of MuJoCo at the same step size."""

from collections.abc import Iterator, Sequence

from skate_env._core import Simulator
from skate_env.studies import timing
from skate_env.studies.fixtures import name_of
from skate_env.studies.motions.mujoco_model import PYRAMIDAL, Setting
from skate_env.studies.timing import Block

from .bodies import MujocoBody, with_equal_contacts
from .peers import tool
from .sizes import Sizes
from .states import STEP, STEPPED, Kind, find
from .table import OURS, Entry, Group, attempted, measure

_INTEGRATORS = ("Euler", "implicitfast", "RK4")
# Steps in a block over all its states; copies of each state in a batch.
_BLOCK, _COPIES = 60, 64
# Steps and largest speed [rad/s, m/s] of the test of stability.
_FALL, _FASTEST = 200, 1e3

BATCH = f"{OURS}, batch"
"""The label of steps of a batch."""


def steps(sizes: Sizes) -> Group:
    """Measure steps in flight, gliding and landing."""
    entries: list[Entry] = []
    for kind in STEPPED:
        entries += _of(kind, find(kind, sizes.states, "fast"))
    title = f"Step of {1e3 * STEP:g} ms"
    group = measure(title, "one step", entries, sizes.rounds)
    group.notes = [
        "IceSkate: accuracy `fast`, with controller and energy balance. `landing` is the step with "
        "the impact of the free heel. Restoring the state is not timed; the times include about "
        "20 ns of the clock.",
        f"`{BATCH}` is the time of one step per robot for a batch of {_COPIES} robots in the same "
        "state, in SIMD lanes: the best case of a batch on one core.",
        "MuJoCo is timed in its second step from the same states, under the same constant torques, "
        "with its default solver and contact. The first step initialises the solver and contains "
        f"the impact of a landing. An integrator is stable if all speeds of a free fall of {_FALL} "
        f"steps stay below {_FASTEST:g} rad/s.",
    ]
    return group


def _of(kind: Kind, sims: Sequence[Simulator]) -> Iterator[Entry]:
    yield _ours(kind, sims, OURS, "step", _BLOCK)
    # The number of copies fills the SIMD registers.
    yield _ours(kind, sims, BATCH, "batch", _COPIES * len(sims))
    for integrator in _INTEGRATORS:
        label = f"MuJoCo, {integrator}"

        def theirs(integrator: str = integrator, label: str = label) -> Iterator[Entry]:
            name = tool("MuJoCo", "mujoco")
            setting = Setting(integrator, STEP, PYRAMIDAL, "default")
            pairs = [(sim, MujocoBody(sim, setting)) for sim in sims]
            # While a foot lands, MuJoCo's other foot bounces.
            bodies = [body for _, body in pairs] if kind.landing else with_equal_contacts(pairs)
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
    what = f"Simulator.measure('{work}') in {len(sims)} states of scene {name_of(kind.scene)}"
    block = timing.inside(sims, work, each)
    return Entry(kind.name, label, OURS, what, block, each * len(sims))


def _steps(bodies: Sequence[MujocoBody]) -> Block:
    saved = [body.saved() for body in bodies]
    step = bodies[0].mj.mj_step
    works = [(body.model, body.data) for body in bodies]

    def restore() -> None:
        for body, state in zip(bodies, saved, strict=True):
            body.restore(state)

    def work() -> None:
        for model, data in works:
            step(model, data)

    return timing.timed(work, restore)
