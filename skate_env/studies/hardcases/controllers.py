"""Controllers that chatter, hurry, or take turns with the contacts."""

import numpy as np

from ..._core import Simulator
from .case import Chapter, Lab
from .fixtures import expect

CHAPTER = Chapter("controllers", [])


def _on_the_switch(lab: Lab, period: float) -> Simulator:
    """Hold the free foot where tau7 turns round, with a controller that samples so often [s]."""
    # The foot's angle is the sum of q1 .. q7.
    q = {"q2": 0.1, "q3": -0.1, "q5": 0.5, "q6": -0.9, "q7": 0.65}
    return lab.simulator(
        "paper",
        {
            "start": {"support_leg": "right", "q": q, "v": {}},
            "control.lifting": None,
            "control.sample_period": period,
            "fall": None,
        },
    )


@CHAPTER.case(
    setup="Eq. 21 switches the ankle between +50 and -30 N m where the free foot stands at 0.25 "
    "rad to the ice: `paper` with that foot on the switch and at rest, for 0.1 s.",
    naive="In continuous time the torque pushes the angle back over the switch: 2,000 switches in "
    "19 ms.",
    law="A sampled controller: one look, and at most one switch, every millisecond.",
    criterion="switches of tau7 per millisecond",
    limit=1.0,
)
def chattering_controller(lab: Lab) -> float:
    sim, switches, last = _on_the_switch(lab, 1e-3), 0, None
    ankle = sim.coordinate_names.index("q7")
    for part in range(1, 1001):
        expect(sim.advance(1e-4 * part), f"ended with {sim.termination}")
        sign = np.sign(sim.torque[ankle])
        switches += last is not None and sign != last
        last = sign
    expect(switches > 10, f"it switches {switches} times")
    return switches / 100.0


@CHAPTER.case(
    setup="The same controller sampled every 10 us, a hundred times as often.",
    naive="Every sample restarts the integrator: a hundred times the price.",
    law="A sample that would change nothing is not a time event.",
    criterion="evaluations over those with the usual millisecond",
    limit={"balanced": 50.0, "reference": 50.0, "rosenbrock": 50.0, "rk4": 50.0, "fast": 50.0},
)
def hasty_controller(lab: Lab) -> float:
    spent = []
    for period in (1e-3, 1e-5):
        sim = _on_the_switch(lab, period)
        sim.advance(0.1)
        expect(sim.termination is None, f"ended with {sim.termination}")
        spent.append(sim.stats()["evaluations"])
    return spent[1] / spent[0]


@CHAPTER.case(
    setup="On ice that only pushes both feet stand and an ankle's torque lifts them in turn, "
    "every microsecond if the controller lets them.",
    naive="Swaps the legs a million times a second, each swap with its own feedforward.",
    law="Evaluations a motion may take for its progress are counted; the controller samples.",
    criterion="evaluations a second over those of the nominal gait",
    limit={"balanced": 15.0, "reference": 15.0, "rosenbrock": 40.0, "rk4": 15.0, "fast": 15.0},
)
def legs_take_turns(lab: Lab) -> float:
    sim = lab.simulator("unilateral")
    nominal = Simulator(lab.scene("paper"))
    nominal.advance(1.0)
    torque = np.zeros(len(sim.q) - 3)
    for part in range(1, 301):
        torque[:6] = 60.0 * (-1.0) ** part * np.array([1.0, 0.0, 0.0, 0.0, 0.0, -1.0])
        if not sim.advance(0.001 * part, torque):
            break
    expect(sim.termination in (None, "fall"), f"ended with {sim.termination}")
    usual = nominal.stats()["evaluations"] / nominal.time
    return sim.stats()["evaluations"] / sim.time / usual
