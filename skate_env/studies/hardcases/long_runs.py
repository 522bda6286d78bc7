"""Long runs: a hundred steps of every preset, and late times."""

from .case import Chapter, Lab
from .fixtures import apart, expect, kinetic, pushing, standing

CHAPTER = Chapter("long runs", [])

_STEPS = 100
_ENERGY = {"balanced": 1e-4, "reference": 1e-9}
_EXCLUDED = "not every gait lives through 100 steps of looser methods"


def _hundred_steps(lab: Lab, preset: str) -> tuple[float, float]:
    """Skate; return energy nobody booked in a step, in kinetic energies, and drift [m]."""
    sim = lab.simulator(preset)
    most, drift, made = kinetic(sim), 0.0, 0
    booked, unbooked = 0.0, 0.0
    while made < _STEPS:
        goes_on = sim.advance(sim.time + 0.01)
        most, drift = max(most, kinetic(sim)), max(drift, sim.violation()[0])
        now = sim.stats()["energy_residual"]
        done = len(sim.take_steps())
        if done or not goes_on:
            made += done
            unbooked, booked = max(unbooked, abs(now - booked)), now
        if not goes_on:
            break
        expect(sim.time < 300.0, f"only {made} steps in 300 s")
    if preset != "unilateral":
        expect(made >= _STEPS, f"only {made} steps: {sim.termination}")
    return unbooked / most, drift


def _gait(preset: str) -> None:
    """Add the case of a preset's energy and that of its drift."""

    def energy(lab: Lab) -> float:
        return _hundred_steps(lab, preset)[0]

    def drift(lab: Lab) -> float:
        return _hundred_steps(lab, preset)[1]

    steps = "the steps until it falls" if preset == "unilateral" else "100 steps"
    energy.__name__ = f"energy_of_{preset}"
    drift.__name__ = f"drift_of_{preset}"
    CHAPTER.case(
        setup=f"`{preset}`: {steps}, landings, friction, swaps and torques booked.",
        naive="Loses or wins a joule a step; after a hundred the gait is another.",
        law="First law of thermodynamics.",
        criterion="energy nobody booked in a step",
        unit="kinetic energies",
        limit=_ENERGY,
        excluded=_EXCLUDED,
    )(energy)
    CHAPTER.case(
        setup=f"`{preset}`: {steps}; how far a foot on the ice is from where its contact holds it.",
        naive="Integrates accelerations of constraints: a foot sinks by a millimetre a minute.",
        law="Constraints of position.",
        criterion="how far the free foot is off its contact",
        unit="m",
        limit={"balanced": 1e-10, "reference": 1e-10},
        excluded=_EXCLUDED,
    )(drift)


for _preset in ("paper", "paper_damped", "paper_arms", "blade", "unilateral"):
    _gait(_preset)


@CHAPTER.case(
    setup="`paper` from t = 0, and the same state put at t = 1e6 s, eleven days later.",
    naive="t + h loses digits: samples of the controller fall a step too late, or twice.",
    law="Nothing in the paper's laws knows the date.",
    criterion="distance between both motions 0.3 s later",
    unit="rad, m, /s",
    limit={"balanced": 1e-5, "reference": 1e-5, "rosenbrock": 1e-4, "rk4": 1e-4},
    excluded="its steps end at multiples of the sample's period, which lie elsewhere then",
)
def late_times(lab: Lab) -> float:
    early, late = lab.simulator("paper"), lab.simulator("paper")
    q, v = late.q, late.v
    day = 1e6
    late.reset_map(day, q, v)
    early.advance(0.3)
    late.advance(day + 0.3)
    return apart(early, late)


@CHAPTER.case(
    setup="Standing upright on both feet on ice that only pushes, ten times the damping, for 5 s.",
    naive="A foot that should rest creeps by rounding, once every step.",
    law="Coulomb: a foot that sticks does not move at all.",
    criterion="way of the supporting foot",
    unit="m",
    limit=0.0,
    methods=("balanced", "reference", "rosenbrock", "fast"),
    excluded="explicit steps of fixed length are unstable here",
)
def standing_still(lab: Lab) -> float:
    scene = pushing(standing())
    damping = {
        name: 10.0 * value
        for name, (value, *_) in scene.parameters().items()
        if name.endswith(".damping")
    }
    sim = lab.simulator(scene.with_values(damping))
    sim.advance(5.0)
    expect(sim.termination is None, f"ended with {sim.termination} at {sim.time} s")
    return abs(float(sim.q[0]))
