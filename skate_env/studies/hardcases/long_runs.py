"""Long simulations: a hundred gait steps of every preset, and late times."""

from ..fixtures import BLADE, PAPER_DAMPED
from .case import CaseContext, CaseGroup
from .fixtures import damped, expect, kinetic, push_only, standing, state_distance

GROUP = CaseGroup("long simulations", [])

_STEPS = 100
_ENERGY = {"balanced": 1e-4, "reference": 1e-9}
_EXCLUDED = "with looser accuracies not every gait makes 100 steps"


def _hundred_steps(context: CaseContext, preset: str) -> tuple[float, float]:
    """Return the largest energy residual of a gait step / kinetic energy, and the drift [m]."""
    sim = context.simulator(preset)
    most, drift, made = kinetic(sim), 0.0, 0
    last, worst = 0.0, 0.0
    while made < _STEPS:
        goes_on = sim.advance(sim.time + 0.01)
        most, drift = max(most, kinetic(sim)), max(drift, sim.violation()[0])
        now = sim.stats()["energy_residual"]
        done = len(sim.take_steps())
        if done or not goes_on:
            made += done
            worst, last = max(worst, abs(now - last)), now
        if not goes_on:
            break
        expect(sim.time < 300.0, f"only {made} steps in 300 s")
    if preset != "push_only":
        expect(made >= _STEPS, f"only {made} steps: {sim.termination}")
    return worst / most, drift


def _gait(preset: str, scene: str) -> None:
    """Add the cases for a preset's energy and for its drift."""

    def energy(context: CaseContext) -> float:
        return _hundred_steps(context, scene)[0]

    def drift(context: CaseContext) -> float:
        return _hundred_steps(context, scene)[1]

    steps = "the gait steps until it falls" if preset == "push_only" else "100 gait steps"
    energy.__name__ = f"energy_of_{preset}"
    drift.__name__ = f"drift_of_{preset}"
    GROUP.case(
        setup=f"`{preset}`: {steps}, with landings, friction, leg swaps and torques.",
        naive="Gains or loses a joule per gait step; after a hundred the gait has changed.",
        law="Conservation of energy.",
        criterion="largest unaccounted energy of a gait step, divided by the kinetic energy",
        limit=_ENERGY | ({"balanced": 5e-3} if preset == "blade" else {}),
        excluded=_EXCLUDED,
    )(energy)
    GROUP.case(
        setup=f"`{preset}`: {steps}.",
        naive="Integrates constraint accelerations only: a foot sinks by a millimetre per minute.",
        law="Constraints of position hold without drift.",
        criterion="largest violation of the free foot's constraints [m]",
        limit={"balanced": 2e-12, "reference": 2e-12},
        excluded=_EXCLUDED,
    )(drift)


for _preset in ("paper", "paper_printed", "paper_arms", "push_only"):
    _gait(_preset, _preset)
_gait("paper_damped", PAPER_DAMPED)
_gait("blade", BLADE)


@GROUP.case(
    setup="`paper_printed` from t = 0 s and the same state from t = 1e6 s.",
    naive="t + h loses digits: samples of the controller are late, or happen twice.",
    law="The equations do not depend on absolute time.",
    criterion="distance between both motions 0.3 s later [rad, m, /s]",
    limit={"balanced": 1e-5, "reference": 1e-5, "rosenbrock": 1e-4, "rk4": 1e-4},
    excluded="its steps end at multiples of the sample period, which are rounded differently there",
)
def late_times(context: CaseContext) -> float:
    early, late = context.simulator("paper_printed"), context.simulator("paper_printed")
    q, v = late.q, late.v
    offset = 1e6
    late.reset_map(offset, q, v)
    early.advance(0.3)
    late.advance(offset + 0.3)
    return state_distance(early, late)


@GROUP.case(
    setup="Standing on both feet with push-only contact and ten times the damping, for 5 s.",
    naive="A resting foot creeps by a rounding error per step.",
    law="Coulomb: a sticking foot does not move.",
    criterion="displacement of the supporting foot [m]",
    methods=("balanced", "reference", "rosenbrock", "fast"),
    excluded="explicit steps of fixed length are unstable here",
)
def standing_still(context: CaseContext) -> float:
    sim = context.simulator(damped(push_only(standing()), 10.0))
    sim.advance(5.0)
    expect(sim.termination is None, f"ended with {sim.termination} at {sim.time} s")
    return abs(float(sim.q[0]))
