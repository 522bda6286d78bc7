"""Find the closed step of ``training/orbits/push_only.npz``.

A nonlinear program is solved from the solution of an earlier search, with limits that become
stricter; then the step is closed in the engine.
"""

import argparse
import sys
from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path

import numpy as np

from skate_env import scenes
from skate_env.common import npz, prepare_folder

from .closing import Stepper, close, follow
from .engine import scene_of
from .limits import Limits
from .problem import solve
from .solution import Solution, load

LEAD = Path(__file__).with_name("push_only_step.npz")
# First without limits on the lift and the time in the air, then with torques and a lift of a human,
# then with half of the step in the air. All at once are too far from the lead.
_LEAD = Limits(residual=150.0, total=400.0, lift=np.inf, air=0.0, ahead=0.6, iterations=90)
_HUMAN = replace(_LEAD, total=345.0, lift=620.0, iterations=60)
_AIR = replace(_HUMAN, air=0.51, iterations=130)
STAGES = (_LEAD, _HUMAN, _AIR, replace(_AIR, iterations=170), Limits())
# With another factor of the published torques; the barrier leaves a margin to all limits.
_FACTOR = Limits(iterations=160, barrier=1e-3, target=1e-3)
# Largest residual torque of the closed step [N m].
LARGEST = 150.0


def main() -> None:
    """Find the step and write it."""
    parser = argparse.ArgumentParser(prog="python -m training.trajectory", description=__doc__)
    parser.add_argument("--lead", type=Path, default=LEAD, help="solution to start from")
    parser.add_argument("--close", action="store_true", help="close the lead, without a search")
    parser.add_argument(
        "--feedforward",
        type=float,
        action="append",
        metavar="FACTOR",
        help="instead of a search, solve from the lead with this factor of the published torques; "
        "repeatable, one after the other",
    )
    parser.add_argument("--out", type=Path, default=Path("out/trajectory"), help="folder")
    args = parser.parse_args()
    prepare_folder(args.out)
    try:
        lead = load(args.lead)
    except (KeyError, OSError, ValueError) as error:
        parser.error(f"{args.lead}: {error}")
    step, command = lead, "python -m training.trajectory"
    if args.close:
        command += f" --lead {args.lead} --close"
    elif args.feedforward:
        command += f" --lead {args.lead}"
        command += "".join(f" --feedforward {factor:g}" for factor in args.feedforward)
        step = solved(lead, [(factor, _FACTOR) for factor in args.feedforward])
    else:
        step = solved(lead, [(lead.scale, limits) for limits in STAGES])
    if not args.close:
        step.save(args.out / "step.npz")
    stepper = Stepper(step)
    run = close(stepper, follow(stepper))
    largest = float(np.abs(run.torques).max())
    if largest > LARGEST:
        raise RuntimeError(f"the closed step needs {largest:.1f} N m, more than {LARGEST}")
    described = {
        "description": f"Push-only contact, a sole of {sum(step.foot[:2]):.2f} m, and "
        f"{step.scale:g} of the published torques without tau1 and tau7. With the torques of the "
        "same file one gait step in the paper's order repeats.",
        "provenance": command,
    }
    text = scenes.replace(scene_of(step), described).to_toml()
    q, v = run.states[0][:19], run.states[0][19:]
    path = args.out / "push_only.npz"
    npz.write(path, {"scene": np.array(text), "q": q, "v": v, "torque": run.torques})
    print(f"{path}: residual {run.largest:.1e} in SI units, torques up to {largest:.1f} N m")
    print(f"python -m training.orbits.push_only --file {path}")


def solved(lead: Solution, problems: Iterable[tuple[float, Limits]]) -> Solution:
    """Solve from a lead with factors of the feedforward and limits, one after the other."""
    step = lead
    for factor, limits in problems:
        # IPOPT prints its iterations.
        guess = replace(step, scale=factor)
        step, status, violation = solve(limits, guess, show=sys.stdout.isatty())
        times = ", ".join(f"{1e3 * each:.1f}" for each in step.durations)
        print(f"IPOPT: {status}, violation {violation:.0e}; phases of {times} ms", flush=True)
    return step


if __name__ == "__main__":
    main()
