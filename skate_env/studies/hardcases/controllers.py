"""Controllers that chatter, are sampled fast, or make contacts alternate."""

import numpy as np

from ..._core import Simulator
from .case import CaseContext, CaseGroup
from .fixtures import expect

GROUP = CaseGroup("controllers", [])


def _at_switching_angle(context: CaseContext, period: float) -> Simulator:
    """Put the free foot at the angle where tau7 changes sign; `period` is the sample period [s]."""
    # The foot's angle is the sum of q1 .. q7.
    q = {"q2": 0.1, "q3": -0.1, "q5": 0.5, "q6": -0.9, "q7": 0.65}
    return context.simulator(
        "paper_printed",
        {
            "start": {"support_leg": "right", "q": q, "v": {}},
            "control.lifting": None,
            "control.sample_period": period,
            "fall": None,
        },
    )


@GROUP.case(
    setup="Eq. 21 switches the ankle torque between +50 and -30 N m at a foot angle of 0.25 rad: "
    "scene `paper_printed` with the free foot at rest at that angle, for 0.1 s.",
    naive="In continuous time the torque drives the angle back: 2,000 switches in 19 ms.",
    law="A sampled controller switches at most once per sample, here once per millisecond.",
    criterion="switches of tau7 per millisecond",
    limit=1.0,
)
def chattering_controller(context: CaseContext) -> float:
    sim, switches, last = _at_switching_angle(context, 1e-3), 0, None
    ankle = sim.coordinate_names.index("q7")
    for part in range(1, 1001):
        expect(sim.advance(1e-4 * part), f"ended with {sim.termination}")
        sign = np.sign(sim.torque[ankle])
        switches += last is not None and sign != last
        last = sign
    expect(switches > 10, f"it switches {switches} times")
    return switches / 100.0


@GROUP.case(
    setup="The same controller, sampled every 10 us instead of every 1 ms.",
    naive="Restarts the integrator at every sample: a hundred times the cost.",
    law="A sample that does not change the torque is not a time event.",
    criterion="evaluations, divided by those with a sample period of 1 ms",
    limit={"balanced": 50.0, "reference": 50.0, "rosenbrock": 50.0, "rk4": 50.0, "fast": 50.0},
)
def hasty_controller(context: CaseContext) -> float:
    spent = []
    for period in (1e-3, 1e-5):
        sim = _at_switching_angle(context, period)
        sim.advance(0.1)
        expect(sim.termination is None, f"ended with {sim.termination}")
        spent.append(sim.stats()["evaluations"])
    return spent[1] / spent[0]


@GROUP.case(
    setup="Both feet on push-only ice. A torque lifts them in turn; it changes sign every 1 ms.",
    naive="Swaps the legs up to a million times per second; every swap changes the torques.",
    law="The controller is sampled, and the number of evaluations per simulated time is limited.",
    criterion="evaluations per second, divided by those of paper_printed's gait",
    limit={"balanced": 15.0, "reference": 15.0, "rosenbrock": 40.0, "rk4": 15.0, "fast": 15.0},
)
def legs_take_turns(context: CaseContext) -> float:
    sim = context.simulator("push_only")
    nominal = Simulator(context.scene("paper_printed"))
    nominal.advance(1.0)
    torque = np.zeros(len(sim.q) - 3)
    for part in range(1, 301):
        torque[:6] = 60.0 * (-1.0) ** part * np.array([1.0, 0.0, 0.0, 0.0, 0.0, -1.0])
        if not sim.advance(0.001 * part, torque):
            break
    expect(sim.termination in (None, "fall"), f"ended with {sim.termination}")
    usual = nominal.stats()["evaluations"] / nominal.time
    return sim.stats()["evaluations"] / sim.time / usual
