"""Parameters of a scene that a search varies."""

import json
from dataclasses import dataclass
from enum import Enum
from typing import Any

import numpy as np

from skate_env import Scene
from skate_env.replay import Array
from skate_env.scenes import replace


class Group(str, Enum):
    """Groups of variables."""

    lifting = "lifting"
    foot = "foot"
    stabilizers = "stabilizers"
    start = "start"


@dataclass(frozen=True)
class Variable:
    """Fields that change together: by adding ``unit``, or with ``factor`` by a factor exp(unit)."""

    fields: tuple[str, ...]
    unit: float
    factor: bool = False


def variables(scene: Scene, freeze: list[Group]) -> list[Variable]:
    """Return the variables of a scene; effects that it does not have and zero gains are fixed."""
    tree: dict[str, Any] = json.loads(scene.to_json())
    found = []
    if tree["control"]["lifting"] and Group.lifting not in freeze:
        found += [Variable((f"control.lifting.K_p.{i}",), 0.5, True) for i in range(3)]
        found += [Variable((f"control.lifting.{name}",), 0.1) for name in ("ahead", "height")]
    if Group.foot not in freeze:
        found += [Variable((f"body.foot.{name}",), 0.02) for name in ("toe", "heel")]
        if tree["contact"]["edge_damping"] != 0.0:
            found.append(Variable(("contact.edge_damping",), 0.5, True))
    if Group.stabilizers not in freeze:
        for stabilizer, gains in tree["stabilizers"].items():
            used = [gain for gain, value in (gains or {}).items() if value != 0.0]
            found += [Variable((f"stabilizers.{stabilizer}.{gain}",), 0.5, True) for gain in used]
    if Group.start not in freeze:
        # Both arms change together, so a symmetric start stays symmetric; q8 and q10 are fixed.
        joints: list[tuple[str, ...]] = [(f"q{i}",) for i in (2, 3, 4, 5, 6, 7, 9, 17)]
        joints += [(f"q{i}", f"q{i + 3}") for i in (11, 12, 13)]
        for names in (names for names in joints if not set(names) & set(tree["locked"])):
            found.append(Variable(tuple(f"start.q.{name}" for name in names), 0.05))
            found.append(Variable(tuple(f"start.v.{name}" for name in names), 0.5))
        found.append(Variable(("start.v.y0",), 0.2))
    return found


def changed(scene: Scene, variables: list[Variable], x: Array) -> Scene:
    """Change a scene by ``x`` units of the variables.

    Raises
    ------
    ValueError
        If the scene is invalid.
    """
    fields: dict[str, Any] = json.loads(scene.to_json())
    for variable, amount in zip(variables, x, strict=True):
        by = np.exp(amount * variable.unit) if variable.factor else amount * variable.unit
        for name in variable.fields:
            *path, last = name.split(".")
            table: Any = fields
            for part in path:
                table = table[part]
            key: Any = int(last) if isinstance(table, list) else last
            old = table[key] if isinstance(table, list) else table.get(key, 0.0)
            # Rounded, so that the file holds exactly the values of the run.
            table[key] = float(f"{old * by if variable.factor else old + by:.6g}")
    return replace(scene, fields)
