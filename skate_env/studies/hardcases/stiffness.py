"""Stiff springs and dampers, extreme torques and rates, and bodies with extreme ratios."""

import numpy as np

from ..._core import TERMINATIONS, Simulator
from .case import CaseContext, CaseGroup
from .fixtures import (
    ON_ONE_LEG,
    ROOT,
    coulomb,
    damped,
    energy,
    energy_residual,
    expect,
    finite,
    kinetic,
    motion,
    push_only,
    relative_residual,
    sampled,
    standing,
)

GROUP = CaseGroup("stiff and extreme scenes", [])


@GROUP.case(
    setup="A swing, joints damped 100 times as much (150,000 1/s), in calls of 50 ms.",
    naive="Explicit Euler is unstable above 13 us and RK4 above 18 us, without a warning.",
    law="Damping only dissipates: the energy decreases.",
    criterion="energy gained in any 50 ms [J]",
    limit={"balanced": 1e-3, "reference": 1e-8, "rosenbrock": 1e-3, "fast": 1e-9},
    excluded="explicit steps of fixed length are unstable here",
)
def strong_damping(context: CaseContext) -> float:
    sim, gained = context.simulator(damped(motion("swing"), 100.0)), 0.0
    last = energy(sim)
    for _ in sampled(sim, 0.5, 0.05):
        now = energy(sim)
        gained, last = max(gained, now - last), now
    expect(sim.termination is None, f"ended with {sim.termination}")
    return gained


@GROUP.case(
    setup="A swing about a fixed foot, hands damped by 1,000 N m s/rad: rates above 1e5 1/s.",
    naive="Stability keeps explicit steps below 20 us: 0.1 s exceeds every budget.",
    law="Singular perturbation: the other coordinates move as with locked hands.",
    criterion="largest difference from the motion with locked hands after 0.1 s [m, rad]",
    limit={"balanced": 1e-4, "rosenbrock": 1e-5, "fast": 1e-6},
    excluded="stability makes the steps of explicit methods too short here",
)
def locked_by_damping(context: CaseContext) -> float:
    hands = ["q13", "q16"]
    sim = context.simulator(motion("swing").with_values({"body.hand.damping": 1e3}))
    other = context.simulator(motion("swing"), {"locked": hands})
    for each in (sim, other):
        each.advance(0.1)
        expect(each.termination is None, f"ended with {each.termination}")
    free = [i for i, name in enumerate(sim.coordinate_names) if name not in hands]
    return float(np.abs(sim.q[free] - other.q).max())


@GROUP.case(
    setup="Lifting with K_p = 1e9 N/m, a million times the paper's; its target is at the head.",
    naive="The spring has a frequency of 10 kHz: steps above 0.1 ms are unstable.",
    law="Statics: the head stays where a spring of this stiffness holds it.",
    criterion="largest distance of the head from its target height in 0.1 s [m]",
    limit={"balanced": 1e-4, "reference": 1e-4, "rosenbrock": 1e-4, "fast": 1e-4},
    excluded="explicit steps of fixed length are unstable here",
)
def stiff_head(context: CaseContext) -> float:
    bare = Simulator(context.scene(standing(), {"start": ON_ONE_LEG}))
    height = float(bare.head_position[2])
    ahead = float(bare.head_position[1] - bare.link_segments()[1, 0, 1])
    lifting = {"K_p": [1e9, 1e9, 1e9], "ahead": ahead, "height": height}
    sim = context.simulator(standing(), {"start": ON_ONE_LEG, "control.lifting": lifting})
    worst = 0.0
    for _ in sampled(sim, 0.1):
        worst = max(worst, abs(float(sim.head_position[2]) - height))
    expect(sim.termination is None, f"ended with {sim.termination}")
    return worst


@GROUP.case(
    setup="`paper_printed` with ten times the damping of all joints and a hundred times K_p.",
    naive="Fixed steps that suit the paper's values are unstable, without a warning.",
    law="Conservation of energy.",
    criterion="unaccounted energy in 0.3 s, divided by the kinetic energy",
    limit={"balanced": 5e-3, "reference": 1e-9, "rosenbrock": 1e-3, "fast": 0.5},
    excluded="explicit steps of fixed length are unstable here",
)
def stiff_gait(context: CaseContext) -> float:
    sim = context.simulator(motion("stiff"))
    share = relative_residual(sim, 0.3)
    expect(sim.termination is None, f"ended with {sim.termination}")
    return share


@GROUP.case(
    setup="A knee moves at 20 rad/s into a stop of 1e6 N m/rad.",
    naive="The contact lasts 1 ms, less than a step of 2 ms: energy appears.",
    law="A stop (Hunt and Crossley) returns no more energy than it took.",
    criterion="unaccounted energy in 0.1 s, divided by the kinetic energy",
    limit={"balanced": 1e-4, "reference": 1e-8, "rosenbrock": 1e-2},
    excluded="the contact is shorter than a step of fixed length",
)
def knee_stop(context: CaseContext) -> float:
    q = {"q2": -0.1, "q3": 0.2, "q4": -0.1, "q5": 0.5, "q6": -0.3}
    sim = context.simulator(
        standing(),
        {
            "start": {"support_leg": "right", "q": q, "v": {"q6": 20.0}},
            "stabilizers.knee_stop": {"stiffness": 1e6, "damping": 0.5},
            "contact.free_foot": False,
            "body.joint_damping": False,
        },
    )
    most, worst, stopped = kinetic(sim), 0.0, False
    knee = sim.coordinate_names.index("q6")
    for _ in sampled(sim, 0.1, 0.002):
        most, worst = max(most, kinetic(sim)), max(worst, energy_residual(sim))
        stopped |= sim.v[knee] < 0.0
    expect(stopped and sim.termination is None, f"the stop did not work ({sim.termination})")
    return worst / most


@GROUP.case(
    setup="Random torques up to 1e6 N m for 10,000 steps of 0.1 ms, with a reset after an end.",
    naive="Speeds grow to 1e6 rad/s, infinity and NaN, or a step takes minutes.",
    law="All values are finite until the motion ends with a named cause.",
    criterion="steps with a value that is not finite, or an end without a name [steps]",
)
def violent_torques(context: CaseContext) -> float:
    rng, wrong = np.random.default_rng(8), 0
    sim = context.simulator("paper_printed", {"control.action_period": 1e-4})
    for _ in range(10_000):
        goes_on = sim.step(rng.uniform(-1e6, 1e6, len(sim.q) - ROOT))
        wrong += not finite(sim) if goes_on else sim.termination not in TERMINATIONS
        if not goes_on:
            wrong += not np.isfinite([*sim.q, *sim.v]).all()
            sim.reset()
    return float(wrong)


@GROUP.case(
    setup="Flights that start with joint rates of 1e2 to 1e6 rad/s, the most a scene accepts.",
    naive="Coriolis terms overflow: NaN.",
    law="The state is finite, or the motion ends with a named cause.",
    criterion="starts after which a value is not finite [starts]",
)
def violent_starts(context: CaseContext) -> float:
    wrong = 0
    for rate in 10.0 ** np.arange(2.0, 6.5, 0.5):
        sim = context.simulator(
            motion("flight"), {"start.v": {"q5": rate, "q6": -rate, "q11": rate}}
        )
        sim.advance(0.02)
        state = np.isfinite([*sim.q, *sim.v]).all()
        wrong += not (state and (finite(sim) or sim.termination in TERMINATIONS))
    return float(wrong)


@GROUP.case(
    setup="A swing with a head of 200 kg and thighs of 0.01 kg, and the reverse: ratio 20,000.",
    naive="Inverts a matrix of condition 1e9: the light body's acceleration is lost.",
    law="Conservation of energy.",
    criterion="unaccounted energy in 0.1 s, divided by the total energy",
    limit={"balanced": 1e-6, "reference": 1e-10, "rosenbrock": 1e-4},
    excluded="steps of fixed length are too long for light and short links",
)
def mass_ratios(context: CaseContext) -> float:
    head, leg = "body.head.mass", "body.upper_leg.mass"
    return max(
        _residual_in_swing(context, {a: 200.0, b: 0.01}) for a, b in ((head, leg), (leg, head))
    )


def _residual_in_swing(context: CaseContext, values: dict[str, float]) -> float:
    """Swing such a body without damping; return the unaccounted energy over the total energy."""
    sim = context.simulator(motion("swing").without("joint_damping").with_values(values))
    worst = 0.0
    whole = abs(energy(sim)) + kinetic(sim)
    for _ in sampled(sim, 0.1):
        worst = max(worst, energy_residual(sim) / whole)
    expect(sim.termination is None, f"ended with {sim.termination}")
    return worst


@GROUP.case(
    setup="A swing with arms of 2 m and 0.02 m, hands of 5 mm; and with 0.02 m, 2 m and 0.5 m.",
    naive="Inertias of 1e-6 and 1e3 kg m2 in one matrix: small rows are lost in rounding.",
    law="Conservation of energy.",
    criterion="unaccounted energy in 0.1 s, divided by the total energy",
    limit={"balanced": 1e-6, "reference": 1e-10, "rosenbrock": 1e-4},
    excluded="steps of fixed length are too long for light and short links",
)
def odd_lengths(context: CaseContext) -> float:
    names = ("body.upper_arm.length", "body.lower_arm.length", "body.hand.radius")
    return max(
        _residual_in_swing(context, dict(zip(names, values, strict=True)))
        for values in ((2.0, 0.02, 0.005), (0.02, 2.0, 0.5))
    )


@GROUP.case(
    setup="The same flight with y0 = 0 and with y0 = 1e6 m, the most that a scene accepts.",
    naive="World positions of bodies: differences of values near 1e6 m lose ten digits.",
    law="Translation invariance.",
    criterion="distance between both motions after 0.2 s, without y0 [rad, m, /s]",
    limit={"balanced": 1e-10, "reference": 1e-12, "rosenbrock": 1e-6, "rk4": 1e-12, "fast": 1e-12},
)
def far_away(context: CaseContext) -> float:
    sims = []
    for y0 in (0.0, 1e6):
        start = {"q": {"y0": y0, "z0": 1.0, "q5": 0.5, "q6": -0.9}, "v": {"q5": 3.0, "q11": 3.0}}
        sim = context.simulator(motion("flight"), {"start": start | {"support_leg": "right"}})
        sim.advance(0.2)
        sims.append(sim)
    near, far = sims
    return float(max(abs(near.q[1:] - far.q[1:]).max(), abs(near.v - far.v).max()))


@GROUP.case(
    setup="Arms and legs that start a thousand revolutions further: q + 2000 pi.",
    naive="Takes sines of large sums of angles, or compares such angles with thresholds.",
    law="The motion is invariant under rotations by 2 pi.",
    criterion="distance between both motions after 0.05 s, modulo revolutions [rad, m, /s]",
    limit=1e-9,
)
def many_turns(context: CaseContext) -> float:
    plain = context.simulator(motion("flight"))
    q, v = plain.q, plain.v
    turned = context.simulator(motion("flight"))
    turns = np.zeros_like(q)
    for joint, number in (("q5", 1000), ("q6", -1000), ("q11", 1000), ("q12", 500)):
        turns[plain.coordinate_names.index(joint)] = 2.0 * np.pi * number
    turned.reset(q + turns, v)
    for sim in (plain, turned):
        sim.advance(0.05)
    return float(max(abs(turned.q - turns - plain.q).max(), abs(turned.v - plain.v).max()))


@GROUP.case(
    setup="A robot without gravity and one under 100 m/s2, with push-only contact.",
    naive="Scales tolerances by a weight of 0, or meets forces ten times those of its tuning.",
    law="Conservation of energy; without gravity and torque nothing moves.",
    criterion="unaccounted, or kinetic energy without gravity, in 0.2 s over that under 100 m/s2",
    limit={"balanced": 1e-4, "reference": 1e-9, "rosenbrock": 1e-3, "rk4": 1e-4, "fast": 0.1},
)
def no_weight_and_much(context: CaseContext) -> float:
    worst, whole = 0.0, 1.0
    for gravity in (100.0, 0.0):
        ice = {"gravity": gravity, "friction": coulomb(0.2)}
        sim = context.simulator(push_only(standing()), {"start": ON_ONE_LEG, "ice": ice})
        whole = max(whole, abs(energy(sim)))
        for _ in sampled(sim, 0.2):
            worst = max(worst, energy_residual(sim), kinetic(sim) if gravity == 0.0 else 0.0)
        expect(sim.termination is None, f"ended with {sim.termination}")
    return worst / whole
