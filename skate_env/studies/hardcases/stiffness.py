"""Stiff springs and dampers, violent torques, and bodies out of all proportion."""

import numpy as np

from ..._core import Scene, Simulator
from .case import Chapter, Lab
from .fixtures import (
    ON_ONE_LEG,
    ROOT,
    energy,
    expect,
    finite,
    kinetic,
    motion,
    pushing,
    standing,
    ticks,
    unbooked,
    unbooked_share,
)

CHAPTER = Chapter("stiffness, violence and odd bodies", [])

_ENDS = (None, "fall", "jam", "singular", "step_limit", "not_finite")


def _numbers(scene: Scene, ends_with: str) -> dict[str, float]:
    """Numbers of a scene's body by the ends of their names."""
    return {
        name: value
        for name, (value, *_) in scene.parameters().items()
        if name.startswith("body.") and name.endswith(ends_with)
    }


@CHAPTER.case(
    setup="Every joint's damping times 100 (eigenvalues up to 150,000 1/s), a robot in free "
    "swing, calls of 50 ms.",
    naive="Explicit Euler dies above 13 us, RK4 above 18 us, both without a warning.",
    law="Damping only takes: energy falls.",
    criterion="energy gained in any 50 ms",
    unit="J",
    limit={"balanced": 1e-3, "reference": 1e-8, "rosenbrock": 1e-3, "fast": 1e-9},
    excluded="explicit steps of fixed length are unstable here",
)
def strong_damping(lab: Lab) -> float:
    scene = motion("swing")
    damping = {name: 100.0 * value for name, value in _numbers(scene, ".damping").items()}
    sim, gained = lab.simulator(scene.with_values(damping)), 0.0
    last = energy(sim)
    for _ in ticks(sim, 0.5, 0.05):
        now = energy(sim)
        gained, last = max(gained, now - last), now
    expect(sim.termination is None, f"ended with {sim.termination}")
    return gained


@CHAPTER.case(
    setup="Visual lifting with K_p = 1e9 N/m on the head, a million times the paper's, which "
    "holds it where it starts.",
    naive="The spring's frequency is 10 kHz: any step above 0.1 ms explodes.",
    law="Statics: the head stays where a spring of that stiffness holds it.",
    criterion="distance of the head's height from its target, largest in 0.1 s",
    unit="m",
    limit={"balanced": 1e-4, "reference": 1e-4, "rosenbrock": 1e-4, "fast": 1e-4},
    excluded="explicit steps of fixed length are unstable here",
)
def stiff_head(lab: Lab) -> float:
    bare = Simulator(lab.scene(standing(), {"start": ON_ONE_LEG}))
    height = float(bare.head_position[2])
    ahead = float(bare.head_position[1] - bare.link_segments()[1, 0, 1])
    lifting = {"K_p": [1e9, 1e9, 1e9], "ahead": ahead, "height": height}
    sim, worst = lab.simulator(standing(), {"start": ON_ONE_LEG, "control.lifting": lifting}), 0.0
    for _ in ticks(sim, 0.1):
        worst = max(worst, abs(float(sim.head_position[2]) - height))
    expect(sim.termination is None, f"ended with {sim.termination}")
    return worst


@CHAPTER.case(
    setup="`paper` with ten times the damping of all joints and a hundred times K_p.",
    naive="Fixed steps that were fine for the paper's numbers explode without a warning.",
    law="First law: every joule is booked.",
    criterion="energy nobody booked over 0.3 s",
    unit="kinetic energies",
    limit={"balanced": 1e-5, "reference": 1e-9, "rosenbrock": 1e-3, "fast": 0.5},
    excluded="explicit steps of fixed length are unstable here",
)
def stiff_gait(lab: Lab) -> float:
    sim = lab.simulator(motion("stiff"))
    share = unbooked_share(sim, 0.3)
    expect(sim.termination is None, f"ended with {sim.termination}")
    return share


@CHAPTER.case(
    setup="A knee that runs at 20 rad/s into a stop of 1e6 N m/rad.",
    naive="A contact time of 1 ms inside a step of 2 ms: energy appears.",
    law="A stop (Hunt and Crossley) gives back no more than it took.",
    criterion="energy nobody booked over 0.1 s",
    unit="kinetic energies",
    limit={"balanced": 1e-4, "reference": 1e-8, "rosenbrock": 1e-2},
    excluded="the stop is explicit, and too stiff for steps of fixed length",
)
def knee_stop(lab: Lab) -> float:
    q = {"q2": -0.1, "q3": 0.2, "q4": -0.1, "q5": 0.5, "q6": -0.3}
    sim = lab.simulator(
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
    for _ in ticks(sim, 0.1, 0.002):
        most, worst = max(most, kinetic(sim)), max(worst, unbooked(sim))
        stopped |= sim.v[knee] < 0.0
    expect(stopped and sim.termination is None, f"the stop did not work ({sim.termination})")
    return worst / most


@CHAPTER.case(
    setup="Random torques of 1e6 N m on all joints for 10,000 steps of 0.1 ms; after every end "
    "the next start.",
    naive="Speeds of 1e6 rad/s, then infinity, then NaN that spreads; or a step that takes "
    "minutes.",
    law="Every number is finite while the simulation goes on; it ends by a name.",
    criterion="steps with a number that is not finite, or an end without a name",
    unit="steps",
    limit=0.0,
)
def violent_torques(lab: Lab) -> float:
    rng, wrong = np.random.default_rng(8), 0
    sim = lab.simulator("paper", {"control.action_period": 1e-4})
    for _ in range(10_000):
        goes_on = sim.step(rng.uniform(-1e6, 1e6, len(sim.q) - ROOT))
        wrong += not finite(sim) if goes_on else sim.termination not in _ENDS[1:]
        if not goes_on:
            wrong += not np.isfinite([*sim.q, *sim.v]).all()
            sim.reset()
    return float(wrong)


@CHAPTER.case(
    setup="Starts with joint rates of 1e2 to 1e6 rad/s, the largest a scene may have, in flight.",
    naive="Overflows in the Coriolis terms: NaN.",
    law="The motion goes on with finite numbers or ends by a name.",
    criterion="starts of which something is not finite",
    unit="starts",
    limit=0.0,
)
def violent_starts(lab: Lab) -> float:
    wrong = 0
    for rate in 10.0 ** np.arange(2.0, 6.5, 0.5):
        sim = lab.simulator(motion("flight"), {"start.v": {"q5": rate, "q6": -rate, "q11": rate}})
        sim.advance(0.02)
        state = np.isfinite([*sim.q, *sim.v]).all()
        wrong += not (state and (finite(sim) or sim.termination in _ENDS[1:]))
    return float(wrong)


@CHAPTER.case(
    setup="A head of 200 kg on thighs of 0.01 kg, and the reverse: a ratio of 20,000.",
    naive="Inverts M, whose condition is 1e9, and loses the light body's acceleration.",
    law="First law in free swing.",
    criterion="energy nobody booked over 0.1 s",
    unit="energies",
    limit={"balanced": 1e-6, "reference": 1e-10, "rosenbrock": 1e-4},
    excluded="steps of fixed length are too long for light and short links",
)
def mass_ratios(lab: Lab) -> float:
    head, leg = "body.head.mass", "body.upper_leg.mass"
    return max(_unbooked_in_swing(lab, {a: 200.0, b: 0.01}) for a, b in ((head, leg), (leg, head)))


def _unbooked_in_swing(lab: Lab, values: dict[str, float]) -> float:
    """Swing such a body without damping; return the energy nobody booked at worst, in energies."""
    sim, worst = lab.simulator(motion("swing").without("joint_damping").with_values(values)), 0.0
    whole = abs(energy(sim)) + kinetic(sim)
    for _ in ticks(sim, 0.1):
        worst = max(worst, unbooked(sim) / whole)
    expect(sim.termination is None, f"ended with {sim.termination}")
    return worst


@CHAPTER.case(
    setup="Arms of 2 m and of 0.02 m, hands of 0.5 m radius, in free swing.",
    naive="Inertias of 1e-6 next to 1e3 kg m2: the small one's rows are rounding.",
    law="First law in free swing.",
    criterion="energy nobody booked over 0.1 s",
    unit="energies",
    limit={"balanced": 1e-6, "reference": 1e-10, "rosenbrock": 1e-4},
    excluded="steps of fixed length are too long for light and short links",
)
def odd_lengths(lab: Lab) -> float:
    names = ("body.upper_arm.length", "body.lower_arm.length", "body.hand.radius")
    return max(
        _unbooked_in_swing(lab, dict(zip(names, values, strict=True)))
        for values in ((2.0, 0.02, 0.005), (0.02, 2.0, 0.5))
    )


@CHAPTER.case(
    setup="The same flight with y0 = 0 and y0 = 1e6 m, the farthest a scene may start.",
    naive="Positions of bodies in the world: differences of 1e6 m lose ten digits.",
    law="Galileo: the motion does not know where it is.",
    criterion="distance between both motions after 0.2 s, y0 left out",
    unit="rad, m, /s",
    limit={"balanced": 1e-10, "reference": 1e-12, "rosenbrock": 1e-6, "rk4": 1e-12, "fast": 1e-12},
)
def far_away(lab: Lab) -> float:
    sims = []
    for y0 in (0.0, 1e6):
        start = {"q": {"y0": y0, "z0": 1.0, "q5": 0.5, "q6": -0.9}, "v": {"q5": 3.0, "q11": 3.0}}
        sim = lab.simulator(motion("flight"), {"start": start | {"support_leg": "right"}})
        sim.advance(0.2)
        sims.append(sim)
    near, far = sims
    return float(max(abs(near.q[1:] - far.q[1:]).max(), abs(near.v - far.v).max()))


@CHAPTER.case(
    setup="Arms and legs that start a thousand turns further: q + 2000 pi.",
    naive="Sines of large sums of angles, thresholds on angles that have turned.",
    law="Geometry: a whole turn is no turn.",
    criterion="distance between both motions after 0.05 s, turns left out",
    unit="rad, m, /s",
    limit=1e-9,
)
def many_turns(lab: Lab) -> float:
    plain = lab.simulator(motion("flight"))
    q, v = plain.q, plain.v
    turned = lab.simulator(motion("flight"))
    turns = np.zeros_like(q)
    for joint, number in (("q5", 1000), ("q6", -1000), ("q11", 1000), ("q12", 500)):
        turns[plain.coordinate_names.index(joint)] = 2.0 * np.pi * number
    turned.reset(q + turns, v)
    for sim in (plain, turned):
        sim.advance(0.05)
    return float(max(abs(turned.q - turns - plain.q).max(), abs(turned.v - plain.v).max()))


@CHAPTER.case(
    setup="A robot without gravity, and under 100 m/s2, on ice that only pushes.",
    naive="Tolerances in shares of a weight that is 0; or forces ten times those of tuning.",
    law="First law; without weight and torque nothing moves.",
    criterion="energy nobody booked over 0.2 s, or energy without gravity",
    unit="energies under 100 m/s2",
    limit={"balanced": 1e-4, "reference": 1e-9, "rosenbrock": 1e-3, "rk4": 1e-4, "fast": 0.1},
)
def no_weight_and_much(lab: Lab) -> float:
    worst, whole = 0.0, 1.0
    for gravity in (100.0, 0.0):
        ice = {
            "gravity": gravity,
            "friction": {"kind": "coulomb", "mu": 0.2, "capture_speed": 0.01},
        }
        sim = lab.simulator(pushing(standing()), {"start": ON_ONE_LEG, "ice": ice})
        whole = max(whole, abs(energy(sim)))
        for _ in ticks(sim, 0.2):
            worst = max(worst, unbooked(sim), kinetic(sim) if gravity == 0.0 else 0.0)
        expect(sim.termination is None, f"ended with {sim.termination}")
    return worst / whole
