"""Print a hash of the motion of every preset at every accuracy, as JSON.

Run by ``compare_commits.py`` with the package of each of two commits, so it uses only what both
have.
"""

import hashlib
import json
import sys
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np

import skate_env
from skate_env import Scene, Simulator, load_scene, scene_names

ACCURACIES: tuple[Any, ...] = (
    "fast",
    "balanced",
    "reference",
    {"method": "rk4", "step": 0.001},
    {"method": "rosenbrock", "tolerance": 1e-4},
)
STUDIES = Path(skate_env.__file__).parent / "studies" / "scenes"
# Scenes by the name that they have in both commits: the first of these that there is.
SCENES: dict[str, tuple[str | Path, ...]] = {
    "paper": ("paper",),
    "paper_printed": ("paper_printed", "paper_long_blade"),
    "paper_arms": ("paper_arms",),
    "push_only": ("push_only", "unilateral"),
    "paper_damped": ("paper_damped", STUDIES / "paper_damped.toml"),
    "blade": ("blade", STUDIES / "blade.toml"),
}
ACTIONS = 600
"""Of 10 ms in a single simulation."""
ENVIRONMENTS, BATCH_ACTIONS = 48, 200


def scene_of(name: str) -> Scene:
    """Load a scene of `SCENES`; earlier files have starts of 1e-17, which are zero here."""
    known = scene_names()
    scene = load_scene(next(x for x in SCENES[name] if isinstance(x, Path) or x in known))
    fields = json.loads(scene.to_json())
    for part in ("q", "v"):
        start = fields["start"][part]
        fields["start"][part] = {joint: x for joint, x in start.items() if abs(x) > 1e-15}
    return Scene.from_json(json.dumps(fields))


def with_accuracy(scene: Scene, accuracy: Any) -> Scene:
    """Copy a scene with another accuracy."""
    return Scene.from_json(json.dumps({**json.loads(scene.to_json()), "accuracy": accuracy}))


def simulation(scene: Scene, torque: float) -> str:
    """Hash times, positions and rates of a run under random residual torques of this size [N m]."""
    sim, digest = Simulator(scene), hashlib.sha256()
    rng = np.random.default_rng(1)
    for _ in range(ACTIONS):
        goes_on = sim.step(torque * rng.uniform(-1.0, 1.0, len(sim.q) - 3))
        for part in (sim.q, sim.v, [sim.time, sim.state_number]):
            digest.update(np.asarray(part, dtype=float).tobytes())
        if not goes_on:
            break
    return digest.hexdigest()


def batch(name: str, accuracy: str) -> str:
    """Hash observations and rewards of a vector environment under random actions."""
    envs = gymnasium.make_vec(
        "IceSkate-v0", num_envs=ENVIRONMENTS, scene=scene_of(name), accuracy=accuracy, perturb=0.01
    )
    digest = hashlib.sha256()
    digest.update(envs.reset(seed=0)[0].tobytes())
    rng = np.random.default_rng(2)
    for _ in range(BATCH_ACTIONS):
        actions = rng.uniform(-1.0, 1.0, envs.action_space.shape).astype(np.float32)
        observations, rewards, *_ = envs.step(actions)
        digest.update(observations.tobytes())
        digest.update(rewards.tobytes())
    return digest.hexdigest()


def main() -> None:
    """Print all hashes, named by preset, accuracy and kind of run."""
    hashes = {}
    for name in SCENES:
        for accuracy in ACCURACIES:
            scene = with_accuracy(scene_of(name), accuracy)
            hashes[f"{name} {json.dumps(accuracy)} baseline"] = simulation(scene, 0.0)
            hashes[f"{name} {json.dumps(accuracy)} residual"] = simulation(scene, 20.0)
        for accuracy in ("fast", "balanced"):
            hashes[f"{name} {accuracy} batch"] = batch(name, accuracy)
    json.dump(hashes, sys.stdout, indent=1)


if __name__ == "__main__":
    main()
