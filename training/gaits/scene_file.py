"""Scenes as files, and scenes that start within their cycle."""

import json
from typing import Any

from skate_env import Scene, Simulator
from skate_env.scenes import replace


def settled(scene: Scene, steps: int) -> Scene:
    """Return a scene that starts after a number of steps.

    Raises
    ------
    ValueError
        If the simulation ends before.
    """
    sim = Simulator(replace(scene, {"control.action_period": 1e-4}))
    while sim.step() and (steps := steps - len(sim.take_steps())) > 0:
        pass
    if steps > 0:
        raise ValueError(
            f"the run ends with {sim.termination}, {steps} steps too early for --settle"
        )
    start: dict[str, Any] = {"support_leg": sim.support_leg}
    for part, values in (("q", sim.q), ("v", sim.v)):
        named = zip(sim.coordinate_names, values.round(6).tolist(), strict=True)
        start[part] = {name: x for name, x in named if x != 0.0 and (part, name) != ("q", "y0")}
    return replace(scene, {"start": start})


def toml_of(scene: Scene) -> str:
    """Format a scene as TOML with only the values that differ from the defaults."""
    lines = []

    def put(table: dict[str, Any], default: dict[str, Any], path: str) -> None:
        rest = {key: x for key, x in table.items() if key not in default or x != default[key]}
        values = {key: x for key, x in rest.items() if not isinstance(x, dict)}
        # An effect without own values needs its header.
        if path and (values or not rest):
            lines.extend(["", f"[{path}]"])
        lines.extend(f"{key} = {json.dumps(x, ensure_ascii=False)}" for key, x in values.items())
        for key, x in rest.items():
            if isinstance(x, dict):
                put(x, default.get(key) or {}, f"{path}.{key}" if path else key)

    put(json.loads(scene.to_json()), json.loads(Scene.from_json("{}").to_json()), "")
    return "\n".join(lines) + "\n"
