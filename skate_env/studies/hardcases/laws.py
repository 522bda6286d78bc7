"""Motions that broke a law in random play, by the independent check of `Simulator.laws`."""

from collections.abc import Callable, Iterable, Iterator

import numpy as np

from ..._core import Scene, Simulator
from ...policies import Policy, shipped
from .case import CaseContext, CaseGroup
from .fixtures import ROOT, expect, push_only, standing, state_distance

GROUP = CaseGroup("laws in random play", [])

_AMOUNT = "largest amount by which it is broken, divided by what counts as rounding and truncation"


def _largest(sims: Iterable[Simulator], *names: str) -> float:
    """Largest amount of these laws since `check_laws`, divided by the limit of the check."""
    laws = [law for sim in sims for law in sim.laws() if law["law"] in names]
    return float(max(0.0, *(law["largest"] / law["limit"] for law in laws)))


def _played(context: CaseContext, scene: str, actions: int) -> Iterator[Simulator]:
    """Yield simulators after random actions of 100 N m on the legs."""
    for seed in range(60):
        sim, rng = context.simulator(scene), np.random.default_rng(seed)
        sim.perturb(0.02, seed)
        sim.check_laws()
        torque = np.zeros(len(sim.q) - ROOT)
        for _ in range(actions):
            torque[:6] = rng.choice([-100.0, 100.0], 6)
            if not sim.step(torque):
                break
        yield sim


def _symmetric(context: CaseContext) -> Iterator[Scene]:
    """Yield scenes of a passive robot whose feet slide backward side by side and stop together."""
    for seed in range(30):
        rng = np.random.default_rng(seed)
        shank, knee = rng.uniform([-0.4, 0.3], [-0.1, 0.7])
        hip, speed, trunk = rng.uniform([-0.2, -0.6, 0.3], [0.1, -0.1, 1.5])
        legs = {"q2": shank, "q3": knee, "q4": hip, "q5": -hip, "q6": -knee, "q7": -shank}
        start = {"support_leg": "right", "q": legs, "v": {"y0": speed, "q9": trunk}}
        yield context.scene(push_only(standing()), {"start": start})


@GROUP.case(
    setup="30 symmetric robots on push-only ice; both feet slide backward and stop at one instant.",
    naive="Handles the first foot; the other one keeps its direction, and friction drives it.",
    law="Friction takes energy, and acts against the velocity.",
    criterion=_AMOUNT,
    limit=1.0,
)
def feet_that_stop_together(context: CaseContext) -> float:
    sims = [context.watch(Simulator(scene)) for scene in _symmetric(context)]
    for sim in sims:
        sim.check_laws()
        sim.advance(0.05)
    return _largest(sims, "friction_dissipates", "sliding_direction")


@GROUP.case(
    setup="The same motions in one call of 50 ms, and in a hundred of 0.5 ms.",
    naive="A guard below zero at a step's beginning is not watched; it may rise and fall again.",
    law="The motion does not depend on when a call ends.",
    criterion="distance between both motions [rad, m, /s]",
    limit={"balanced": 1e-5, "reference": 1e-8, "rosenbrock": 1e-3},
    excluded="its last step is shortened to the end of the call",
)
def one_call_or_a_hundred(context: CaseContext) -> float:
    worst = 0.0
    for scene in _symmetric(context):
        whole, parts = (context.watch(Simulator(scene)) for _ in range(2))
        whole.advance(0.05)
        for part in range(1, 101):
            parts.advance(0.0005 * part)
        worst = max(worst, state_distance(whole, parts))
    return worst


@GROUP.case(
    setup="`paper_printed` (friction keeps the sign of a pull, Eq. 13), random torques, 60 starts.",
    naive="Applies Coulomb's law to impulses that pull, so that friction drives the foot.",
    law="An inelastic impact takes energy, also where the ice pulls.",
    criterion=_AMOUNT,
    limit=1.0,
    excluded="its forces are means over steps, in which contact states change",
)
def pulled_landing(context: CaseContext) -> float:
    return _largest(_played(context, "paper_printed", 30), "impacts_dissipate")


@GROUP.case(
    setup="`paper` under random torques, 60 starts: a free foot is pulled and loses its friction.",
    naive="Of two consistent contact states at the same distance takes the first one of its list, "
    "in which the other foot changes, and forces jump by 25 weights.",
    law="Forces are continuous where the sign of a normal force changes.",
    criterion=_AMOUNT,
    limit=1.0,
    excluded="its forces are means over steps, in which contact states change",
)
def pulled_free_foot(context: CaseContext) -> float:
    return _largest(_played(context, "paper", 60), "forces_continuous")


@GROUP.case(
    setup="`paper_printed` with its policy under a gravity of 15 m/s2, and with mu_forward = 1.",
    naive="Follows a solution that becomes infinite in finite time: joints of 5e6 rad/s.",
    law="A foot that wedges ends the motion with a named cause before rates grow.",
    criterion="fastest joint, divided by 1,000 rad/s",
    limit=1.0,
)
def wedged_foot(context: CaseContext) -> float:
    policy, sims = Policy.load(shipped("paper_printed")), []
    for name, value in (("ice.gravity", 15.0), ("ice.friction.mu_forward", 1.0)):
        sims.append(sim := context.simulator("paper_printed", {name: value}))
        sim.check_laws()
        acting = policy.on(sim.scene)
        while sim.time < 3.0 and sim.step(acting.residual(sim)):
            pass
    return _largest(sims, "finite_rates")


@GROUP.case(
    setup="`push_only` from 12 starts without detection of falls, for 2 s: soles land upside down.",
    naive="Sets the angle of a flat sole to 0 where it is pi: the robot jumps by 3 m.",
    law="Upside down it is a contact like any other: nothing jumps, impacts take energy.",
    criterion=_AMOUNT,
    limit=1.0,
)
def upside_down(context: CaseContext) -> float:
    sims = [context.simulator("push_only", {"fall": None}) for _ in range(12)]
    for seed, sim in enumerate(sims):
        sim.perturb(0.02, seed)
        sim.check_laws()
        sim.advance(2.0)
    return _largest(sims, "no_jump", "above_ice", "impacts_dissipate")


@GROUP.case(
    setup="States with the free toe below the ice, and in flight with a raised toe, to `reset`.",
    naive="Reads contacts from positions alone: the robot moves by 10 to 300 mm.",
    law="A state that a motion visits is a start.",
    criterion="largest displacement, and change of a velocity [m, rad/s, m/s]",
    limit=1e-12,
    excluded="its velocities satisfy the constraints to the order of a step",
)
def visited_start(context: CaseContext) -> float:
    states: dict[str, Callable[[Simulator], bool]] = {
        "paper": lambda sim: sim.state_number == 7 and sim.gaps()[1, 1] < -0.01,
        "push_only": lambda sim: sim.state_number == 0 and sim.q[2] > 0.05,
    }
    worst = 0.0
    for scene, reached in states.items():
        sim, again = context.simulator(scene), context.simulator(scene)
        while not reached(sim):
            expect(sim.advance(sim.time + 1e-3), "no such state")
        again.reset(sim.q, sim.v, sim.support_leg)
        expect(again.state_name == sim.state_name, f"{sim.state_name} becomes {again.state_name}")
        moved = abs(again.link_segments() - sim.link_segments()).max()
        worst = max(worst, moved, abs(again.v - sim.v).max())
    return float(worst)


@GROUP.case(
    setup="A robot in the air without gravity; 40 patterns of torques of 100 N m on the legs.",
    naive="Forces at the middle of a step only: the robot pushes itself to 2 m/s in 0.6 s.",
    law="Newton: without external forces the centre of mass stays at rest.",
    criterion="largest speed of the centre of mass within 0.6 s [m/s]",
    limit={"balanced": 2e-3, "reference": 1e-9, "rosenbrock": 1e-2, "rk4": 5e-2, "fast": 1e-12},
)
def thrust_from_inside(context: CaseContext) -> float:
    legs = {"q2": 0.2, "q3": 0.4, "q4": -0.3, "q5": -0.3, "q6": -0.4, "q7": 0.1}
    start = {"support_leg": "right", "q": legs | {"z0": 3.0, "q1": -0.2}, "v": {}}
    rng, worst = np.random.default_rng(1), 0.0
    for _ in range(40):
        sim = context.simulator(push_only(standing()), {"start": start, "ice.gravity": 0.0})
        mass, torque = sim.mass_matrix(sim.q)[1, 1], np.zeros(len(sim.q) - ROOT)
        pattern = rng.choice([-100.0, 100.0], (int(rng.integers(2, 13)), 6))
        for part in range(60):
            torque[:6] = pattern[part % len(pattern)]
            expect(sim.step(torque), f"ended with {sim.termination}")
        worst = max(worst, float(np.hypot(*sim.momentum(sim.q, sim.v)[:2]) / mass))
    return worst
