"""One gait step in the paper's order on push-only ice that ends as it began, mirrored.

``python -m training.orbits.push_only`` replays it in the engine, prints what it does, and designs a
feedback about it. The torques are held for 1 ms each; ``python -m training.trajectory`` found
them.
"""

import argparse
import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from skate_env import Scene, Simulator, _core
from skate_env.common import opened, prepare_file, write_figure
from skate_env.gait import SHORTEST_VISIT, StepOrder, step_orders
from skate_env.scenes import Mirror, replace

from . import feedback, forced
from .close import Orbit
from .strobe import Start, Strobe

Array = NDArray[np.float64]

FILE = Path(__file__).with_name("push_only.npz")
# Time for which a torque is held [s].
TICK = 1e-3
# Residual torque of a full action of the feedback [N m], and its weight in the design.
_ARMS = {"q11": 30.0, "q12": 30.0, "q13": 10.0, "q14": 30.0, "q15": 30.0, "q16": 10.0, "q17": 100.0}
SCALE = {f"q{i}": 150.0 for i in range(2, 11)} | _ARMS
WEIGHT = 2.0
# Joint of tau8, and the largest change of its amplitude at once [N m].
WAIST, _TAU8_STEP = "q8", 4.0
# Space between the robots in the picture [m].
_SHIFT = 0.5


@dataclass(frozen=True)
class Replay:
    """What one step does.

    Attributes
    ----------
    residual
        Largest difference between the mirrored end and the start [m, rad, m/s, rad/s].
    order
        Contact states from the start to the swap of the legs.
    record
        The engine's record of the step, see `Simulator.take_steps`.
    loads
        Normal forces at heel and toe of both feet, each millisecond until the swap (t, 2, 2) [N].
    segments
        Ends of all links at these times (t, 17, 2, 3) [m].
    torque
        Largest torque of a joint at these times [N m].
    lift
        Largest vertical force of the visual lifting at these times [N].
    """

    residual: float
    order: StepOrder
    record: dict[str, float]
    loads: Array
    segments: Array
    torque: float
    lift: float


def load(path: Path = FILE) -> tuple[_core.Simulator, Array]:
    """Return a simulator at the start of a step, and the torques (t, 16) [N m]."""
    with opened(path) as archive, np.load(archive, allow_pickle=False) as file:
        sim = Simulator(Scene.from_toml(str(file["scene"])))
        sim.reset(file["q"], file["v"], "right")
        return sim, file["torque"]


def replay(sim: _core.Simulator, torques: Array) -> Replay:
    """Simulate one step from its start.

    Raises
    ------
    RuntimeError
        If the simulation ends before.
    """
    q, v, leg = sim.q, sim.v, sim.support_leg
    loads, segments, totals, lifts = [], [], [], []
    values = sim.scene.parameters()
    stiffness, height = (values[f"control.lifting.{name}"][0] for name in ("K_p.2", "height"))
    for i, torque in enumerate(torques):
        if not sim.advance((i + 1) * TICK, torque):
            raise RuntimeError(f"the step ends with {sim.termination} at {sim.time:.4f} s")
        if sim.support_leg == leg:
            loads.append(sim.contact_forces[:, 2:])
            segments.append(sim.link_segments())
            totals.append(np.abs(sim.torque).max())
            lifts.append(abs(stiffness * (height - sim.head_position[2])))
    mirror = Mirror(sim.coordinate_names)
    ends = np.concatenate([mirror(sim.q)[1:] - q[1:], mirror(sim.v) - v])
    (record,) = sim.take_steps()
    (order,) = step_orders(sim.take_events(), [0.0, record["time"]])
    return Replay(
        residual=float(np.abs(ends).max()),
        order=order,
        record=record,
        loads=np.array(loads),
        segments=np.array(segments),
        torque=max(totals),
        lift=max(lifts),
    )


def orbit(sim: _core.Simulator, torques: Array) -> Orbit:
    """Close the motion after the step, which needs no reset and so has the memory of the engine.

    Raises
    ------
    RuntimeError
        If it does not close.
    """
    strobe, ticks = Strobe(sim.scene), len(torques)
    strobe.sim.reset(sim.q, sim.v, sim.support_leg)
    first = Start(strobe.sim.snapshot(), 0, TICK, 1, ticks, torques, sim.support_leg)
    strobe.advance(first, ticks * TICK)
    mirrored: Array = np.asarray(Mirror(sim.coordinate_names[3:])(torques), np.float64)
    again = Start(strobe.sim.snapshot(), ticks, TICK, 1, ticks, mirrored, strobe.sim.support_leg)
    found = forced.close(strobe, again, np.array(list(SCALE.values())))
    if found is None:
        raise RuntimeError("the step does not close")
    return found


def with_tau8(found: Orbit, amplitude: float) -> Orbit:
    """Close the orbit with tau8 [N m] and without a residual torque at the waist, step by step.

    Raises
    ------
    RuntimeError
        If it does not close.
    """
    scale = np.array([0.0 if name == WAIST else each for name, each in SCALE.items()])
    for each in np.linspace(0.0, amplitude, 1 + math.ceil(amplitude / _TAU8_STEP)):
        swing = {"control.arm_swing": {"amplitude": float(each)}}
        strobe = Strobe(replace(found.strobe.scene, swing))
        strobe.set(found.strobe.at(found.start), found.start.leg)
        assert found.start.torques is not None
        torques = found.start.torques.clip(-scale, scale)
        ticks = found.start.samples
        start = Start(strobe.sim.snapshot(), 0, TICK, 1, ticks, torques, found.start.leg)
        closed = forced.close(strobe, start, scale)
        if closed is None:
            raise RuntimeError(f"the step does not close with tau8 of {each:.1f} N m")
        found = closed
    return found


def _colour(row: int) -> str:
    """Colour of a row of `Simulator.link_segments` while the right leg supports."""
    if row in (3, 7, 8, 9, 16):
        return "0.2"
    return "#0072B2" if row < 3 or 10 <= row < 13 else "#D55E00"


def draw(made: Replay, weight: float) -> Figure:
    """Draw the robot nine times in a step, and the loads of the ends of its soles."""
    figure = Figure(figsize=(11.0, 6.0), layout="constrained")
    body, loads = figure.subplots(2, 1, height_ratios=(1.6, 1.0))
    for place, i in enumerate(np.linspace(0, len(made.segments) - 1, 9).astype(int)):
        for row, link in enumerate(made.segments[i]):
            y = link[:, 1] + _SHIFT * place
            body.plot(y, link[:, 2], color=_colour(row), linewidth=1.5)
        head = made.segments[i][16, 1, 1] + _SHIFT * place
        body.annotate(f"{i + 1} ms", (head, 1.8), ha="center", fontsize=8)
    body.axhline(0.0, color="0.6", linewidth=1.0)
    for label, row in (("right, supporting", 0), ("left", 6), ("trunk and head", 16)):
        body.plot([], [], color=_colour(row), label=label)
    body.legend(fontsize=8, ncols=3, loc="lower right", frameon=False)
    body.set_aspect("equal")
    body.set_ylim(-0.35, 2.0)
    body.set_xlabel(f"y [m], robots shifted by {_SHIFT} m from one to the next")
    body.set_ylabel("z [m]")
    times = np.arange(1, len(made.loads) + 1)
    for foot, colour in enumerate(("#0072B2", "#D55E00")):
        for end, style in enumerate(("--", "-")):
            label = f"{('supporting', 'free')[foot]} {('heel', 'toe')[end]}"
            loads.plot(times, made.loads[:, foot, end] / weight, style, color=colour, label=label)
    start = 0.0
    for state, time in made.order.visits:
        if time > SHORTEST_VISIT:
            loads.axvline(1e3 * start, color="0.8", linewidth=1.0)
            loads.annotate(f"{state}", (1e3 * (start + 0.5 * time), 3.1), ha="center")
        start += time
    loads.set_xlabel("time since the swap of the legs [ms]; numbers: contact state")
    loads.set_ylabel("load [body weights]")
    loads.set_ylim(-0.1, 3.4)
    loads.legend(fontsize=8)
    return figure


def main() -> None:
    """Replay the step and print it."""
    parser = argparse.ArgumentParser(
        prog="python -m training.orbits.push_only", description=(__doc__ or "").splitlines()[0]
    )
    parser.add_argument("--picture", type=Path, help="draw the step into this PNG file")
    parser.add_argument(
        "--feedback", type=Path, help="write a linear feedback about the step, a policy"
    )
    parser.add_argument(
        "--tau8",
        type=float,
        default=0.0,
        help="amplitude of tau8 in the feedback's scene, instead of residual torques at the waist; "
        "6 is a fifth of the published one, like the other torques [N m]",
    )
    parser.add_argument(
        "--weight", type=float, default=WEIGHT, help="of a full torque in the feedback's design"
    )
    parser.add_argument(
        "--after-swap",
        action="store_true",
        help="start the feedback's scene after a swap of the legs, where the times from which the "
        "feedforward counts are those of the step, not in the middle of the time on one foot",
    )
    parser.add_argument("--file", type=Path, default=FILE, help="of python -m training.trajectory")
    args = parser.parse_args()
    if args.feedback is None and (args.tau8, args.weight, args.after_swap) != (0.0, WEIGHT, False):
        parser.error("--tau8, --weight and --after-swap need --feedback")
    if not 0.0 <= args.tau8 <= 30.0:
        parser.error(f"--tau8 {args.tau8}: must lie in [0, 30] N m")
    if not 1e-6 <= args.weight <= 1e6:
        parser.error(f"--weight {args.weight}: must lie in [1e-6, 1e6]")
    try:
        for target in filter(None, (args.picture, args.feedback)):
            prepare_file(target)
    except OSError as error:
        parser.error(str(error))
    try:
        sim, torques = load(args.file)
    except (KeyError, OSError, ValueError) as error:
        parser.error(f"{args.file}: {error}")
    made = replay(sim, torques)
    weight = 9.81 * sum(body["mass"] for body in sim.bodies())
    if args.picture:
        write_figure(args.picture, draw(made, weight), dpi=110)
    if args.feedback:
        closed, scale = orbit(*load(args.file)), SCALE
        if args.tau8:
            scale = SCALE | {WAIST: 0.0}
            try:
                closed = with_tau8(closed, args.tau8)
            except RuntimeError as error:
                parser.error(str(error))
        designed = feedback.design(closed, scale, weight=args.weight, after_swap=args.after_swap)
        designed.save(args.feedback)
    print(f"one step of {len(torques) * TICK:.3f} s, {made.record['progress']:.2f} m to the swap")
    for state, time in made.order.visits:
        print(f"  state {state:2}  {1e3 * time:7.2f} ms")
    print(f"heel and flat double support: {1e3 * made.order.double:.0f} ms")
    print(f"mirrored end minus start: {made.residual:.1e} in SI units")
    print(f"largest residual torque: {np.abs(torques).max():.1f} N m")
    print(f"largest torque of a joint: {made.torque:.0f} N m")
    print(f"largest lift on the head: {made.lift / weight:.2f} body weights")
    print(f"inadmissible forces: {1e3 * made.record['inadmissible_time']:.0f} ms")
    print(f"largest load of a foot: {made.loads.sum(axis=2).max() / weight:.2f} body weights")


if __name__ == "__main__":
    main()
