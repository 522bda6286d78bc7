"""One gait step in the paper's order on push-only ice that ends as it began, mirrored.

``python -m training.push_only_orbit`` replays it in the engine and prints what it does. The torques
are held for 1 ms each; docs/push-only-orbit.md says how they were found.
"""

import argparse
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from skate_env import Scene, Simulator, _core
from skate_env.contact_sequence import SHORTEST_VISIT
from skate_env.mirror import Mirror

Array = NDArray[np.float64]

FILE = Path(__file__).parent / "orbits" / "push_only.npz"
# Time for which a torque is held [s].
TICK = 1e-3
# Space between the robots in the picture [m].
_SHIFT = 0.5


@dataclass(frozen=True)
class Replay:
    """What one step does.

    Attributes
    ----------
    residual
        Largest difference between the mirrored end and the start [m, rad, m/s, rad/s].
    visits
        Contact states in sequence, each with the time at which it begins [s].
    torque
        Largest residual torque by joint [N m].
    loads
        Normal forces at heel and toe of both feet, after each millisecond (t, 2, 2) [N].
    cone
        Largest share of the friction cone that a foot uses, after each millisecond.
    slide
        Distance of the hips' motion [m].
    segments
        Ends of all links after each millisecond (t, 17, 2, 3) [m].
    """

    residual: float
    visits: list[tuple[int, float]]
    torque: Array
    loads: Array
    cone: float
    slide: float
    segments: Array


def load() -> tuple[_core.Simulator, Array]:
    """Return a simulator at the start of the step, and the torques (t, 16) [N m]."""
    with np.load(FILE, allow_pickle=False) as file:
        sim = Simulator(Scene.from_toml(str(file["scene"])))
        sim.reset(file["q"], file["v"], "right")
        return sim, file["torque"]


def replay(sim: _core.Simulator, torques: Array) -> Replay:
    """Simulate one step from its start."""
    q, v, first = sim.q, sim.v, sim.state_number
    hips = sim.link_segments()[3].mean(axis=0)[1]
    law = [sim.scene.parameters()[f"ice.friction.mu_{way}"][0] for way in ("forward", "backward")]
    loads, cone, segments = np.empty((len(torques), 2, 2)), 0.0, []
    for i, torque in enumerate(torques):
        if not sim.advance((i + 1) * TICK, torque):
            raise RuntimeError(f"the step ends with {sim.termination} at {sim.time:.4f} s")
        forces = sim.contact_forces
        loads[i] = forces[:, 2:]
        segments.append(sim.link_segments())
        for friction, normal in forces[:, :2]:
            if normal > 0.0:
                # Friction against forward sliding is negative.
                cone = max(cone, -friction / (law[0] * normal), friction / (law[1] * normal))
    mirror = Mirror(sim.coordinate_names)
    ends = np.concatenate([mirror(sim.q)[1:] - q[1:], mirror(sim.v) - v])
    changes = [(after, time) for time, _, before, after, _ in sim.take_events() if before != after]
    return Replay(
        residual=float(np.abs(ends).max()),
        visits=[(first, 0.0), *changes],
        torque=np.abs(torques).max(axis=0),
        loads=loads,
        cone=cone,
        slide=float(sim.link_segments()[3].mean(axis=0)[1] - hips),
        segments=np.array(segments),
    )


def draw(made: Replay, weight: float) -> Figure:
    """Draw the robot nine times in a step, and the loads of the ends of its soles."""
    figure = Figure(figsize=(11.0, 6.0), layout="constrained")
    body, loads = figure.subplots(2, 1, height_ratios=(1.6, 1.0))
    for place, i in enumerate(np.linspace(0, len(made.segments) - 2, 9).astype(int)):
        for link in made.segments[i]:
            free = link[:, 0].mean() < 0.0
            y = link[:, 1] + _SHIFT * place
            body.plot(y, link[:, 2], color="#D55E00" if free else "#0072B2", linewidth=1.5)
        head = made.segments[i][16, 1, 1] + _SHIFT * place
        body.annotate(f"{i + 1} ms", (head, 1.8), ha="center", fontsize=8)
    body.axhline(0.0, color="0.6", linewidth=1.0)
    body.set_aspect("equal")
    body.set_ylim(-0.1, 2.0)
    body.set_xlabel(f"y [m], each {_SHIFT} m further than it is")
    body.set_ylabel("z [m]")
    times = np.arange(1, len(made.loads) + 1)
    for foot, colour in enumerate(("#0072B2", "#D55E00")):
        for end, style in enumerate(("--", "-")):
            label = f"{('supporting', 'free')[foot]} {('heel', 'toe')[end]}"
            loads.plot(times, made.loads[:, foot, end] / weight, style, color=colour, label=label)
    for (state, start), (_, end_time) in pairwise(made.visits):
        if end_time - start > SHORTEST_VISIT:
            loads.axvline(1e3 * start, color="0.8", linewidth=1.0)
            loads.annotate(f"{state}", (500.0 * (start + end_time), 3.1), ha="center")
    loads.set_xlabel("time since the swap of the legs [ms]; numbers: contact state")
    loads.set_ylabel("load [body weights]")
    loads.set_ylim(-0.1, 3.4)
    loads.legend(fontsize=8)
    return figure


def main() -> None:
    """Replay the step and print it."""
    parser = argparse.ArgumentParser(
        prog="python -m training.push_only_orbit", description=(__doc__ or "").splitlines()[0]
    )
    parser.add_argument("--picture", type=Path, help="draw the step into this PNG file")
    args = parser.parse_args()
    sim, torques = load()
    made = replay(sim, torques)
    duration, weight = len(torques) * TICK, 9.81 * sum(body["mass"] for body in sim.bodies())
    if args.picture:
        draw(made, weight).savefig(args.picture, dpi=110)
    print(f"one step of {duration:.3f} s, {made.slide:.2f} m")
    for (state, start), (_, end) in zip(
        made.visits, [*made.visits[1:], (0, duration)], strict=True
    ):
        print(f"  state {state:2}  {1e3 * (end - start):7.2f} ms")
    print(f"mirrored end minus start: {made.residual:.1e} in SI units")
    print(f"largest residual torque: {made.torque.max():.1f} N m")
    print(f"least load of an end: {made.loads.min():.1f} N")
    print(f"largest load of a foot: {made.loads.sum(axis=2).max() / weight:.2f} body weights")
    print(f"largest share of a friction cone: {made.cone:.3f}")


if __name__ == "__main__":
    main()
