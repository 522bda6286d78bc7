"""Find the closed step of ``training/orbits/push_only.npz``.

It starts from the gait of ``paper``, whose feet pull, and tightens the limits in eight solutions of
a nonlinear program; then it closes the step in the engine. Solutions that are in the folder already
are not repeated.
"""

import argparse
from pathlib import Path

import numpy as np
from tqdm import tqdm

from skate_env import Simulator, load_scene, npz
from skate_env.scenes import replace

from .closing import Stepper, close, follow
from .engine import scene_of
from .first_guess import first_guess
from .limits import STAGES
from .problem import Problem
from .robot import Robot
from .solution import Solution, load

# Largest residual torque of the closed step [N m].
LARGEST = 150.0


def solutions(out: Path, scale: float) -> Solution:
    """Solve one stage after the other; return the last solution."""
    step = first_guess("paper", scale, STAGES[0].intervals)
    for number, limits in enumerate(tqdm(STAGES, unit="solution")):
        path = out / f"{number}.npz"
        if path.exists():
            step = load(path)
            continue
        step, status = Problem(_robot(limits.foot), limits, scale, step).solve()
        step.save(path)
        times = ", ".join(f"{1e3 * each:.1f}" for each in step.durations)
        tqdm.write(f"solution {number}: {status}; {times} ms")
    return step


def _robot(foot: tuple[float, float, float]) -> Robot:
    toe, heel, _ = foot
    scene = replace(load_scene("unilateral"), {"body.foot.toe": toe, "body.foot.heel": heel})
    return Robot(Simulator(scene), foot, scene.parameters()["body.head.length"][0])


def main() -> None:
    """Find the step and write it."""
    lines = (__doc__ or "").splitlines()
    parser = argparse.ArgumentParser(prog="python -m training.trajectory", description=lines[0])
    parser.add_argument("--out", type=Path, default=Path("out/trajectory"), help="folder")
    parser.add_argument(
        "--feedforward", type=float, default=0.2, help="factor of the printed torques"
    )
    args = parser.parse_args()
    args.out.mkdir(parents=True, exist_ok=True)
    step = solutions(args.out, args.feedforward)
    stepper = Stepper(step)
    run = close(stepper, follow(stepper))
    largest = float(np.abs(run.torques).max())
    if largest > LARGEST:
        raise RuntimeError(f"the closed step needs {largest:.1f} N m, more than {LARGEST}")
    scene = replace(scene_of(step), {"provenance": "python -m training.trajectory"})
    q, v = run.states[0][:19], run.states[0][19:]
    path = args.out / "push_only.npz"
    npz.write(path, {"scene": np.array(scene.to_toml()), "q": q, "v": v, "torque": run.torques})
    print(f"{path}: residual {run.largest:.1e} in SI units, torques up to {largest:.1f} N m")
    print(f"python -m training.push_only_orbit --file {path}")


if __name__ == "__main__":
    main()
