"""Random valid scenes and random torques."""

import json
from typing import Any

import numpy as np
from numpy.typing import NDArray

from skate_env import Scene
from skate_env.scenes import load_scene, replace
from skate_env.studies.fixtures import BLADE, PAPER_DAMPED

# Scenes to begin with: the presets, and those of studies.
SCENES = (BLADE, "paper", "paper_arms", PAPER_DAMPED, "paper_printed", "push_only")
# Mean start posture of the default scene, with the free foot above the ice [rad].
_POSTURE = {"q2": 0.1, "q3": -0.2, "q5": 0.5, "q6": -0.9, "q7": 0.4}
# Probabilities of a preset, of switching an effect and of changing a number.
_PRESETS, _SWITCHED, _CHANGED = 0.7, 0.3, 0.1
# Numbers that are not changed: costs of steps are compared at one accuracy and one period.
_KEPT = ("start", "accuracy", "control.action_period")
# Smallest value of a logarithmic distribution, relative to the upper limit.
_SMALL = 1e-6
# Probabilities of no torques, of full actions, of multiples of these, and of extreme torques.
_SHARES = (0.15, 0.3, 0.45, 0.1)
# Ranges of the multiples and of the extreme torques [N m], decimal logarithms.
_MULTIPLE, _EXTREME = (-2.0, 1.0), (3.0, 6.0)

Accuracy = str | float | dict[str, Any]


def draw_scene(rng: np.random.Generator, accuracy: Accuracy) -> Scene:
    """Draw a preset or the default scene, switch some effects and change a tenth of its numbers.

    Most changed numbers are near the old ones; some are uniform or log-uniform in their range.
    Every scene is valid, but a foot may start below the ice. The action period does not change.

    Raises
    ------
    ValueError
        If the accuracy is unknown.
    """
    scene = replace(_base(rng), {"accuracy": accuracy})
    for effect, is_on in scene.effects().items():
        if rng.random() < _SWITCHED:
            try:
                scene = scene.without(effect) if is_on else scene.with_effect(effect)
            except ValueError:
                continue  # The rest of the scene contradicts the change.
    values = {}
    for name, (value, low, high, _) in scene.parameters().items():
        if not name.startswith(_KEPT) and rng.random() < _CHANGED:
            values[name] = _number(rng, value, low, high)
    try:
        return scene.with_values(values)
    except ValueError:
        return scene


def _base(rng: np.random.Generator) -> Scene:
    if rng.random() < _PRESETS:
        return load_scene(str(rng.choice(SCENES)))
    start = {
        "q": {joint: q + rng.uniform(-0.1, 0.1) for joint, q in _POSTURE.items()},
        "v": {joint: rng.uniform(-1.0, 1.0) for joint in _POSTURE} | {"y0": rng.uniform(-3.0, 3.0)},
    }
    return Scene.from_json(json.dumps({"start": start}))


def _number(rng: np.random.Generator, value: float, low: float, high: float) -> float:
    match rng.integers(5):
        case 0:
            drawn = rng.uniform(low, high)
        case 1 if low >= 0.0:
            least = max(low, _SMALL * high)
            drawn = least * (high / least) ** rng.random()
        case _:
            drawn = value * rng.uniform(0.5, 2.0)
    return float(np.clip(drawn, low, high))


def torque_scale(rng: np.random.Generator, full: NDArray[np.float64]) -> NDArray[np.float64]:
    """Draw the largest torque of every joint of an episode; ``full`` is that of full actions."""
    match rng.choice(len(_SHARES), p=_SHARES):
        case 0:
            return 0.0 * full
        case 1:
            return full
        case 2:
            return float(10.0 ** rng.uniform(*_MULTIPLE)) * full
        case _:
            return np.full(full.shape, 10.0 ** rng.uniform(*_EXTREME))
