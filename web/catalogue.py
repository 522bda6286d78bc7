"""Write the catalogue of the hard cases for the page: texts, limits, measured values, scenes.

``python web/catalogue.py`` renews web/src/cases/catalogue.json.
"""

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from skate_env import Scene
from skate_env.common import write_text
from skate_env.studies.hardcases.case import Case, CaseContext
from skate_env.studies.hardcases.catalogue import CASES
from skate_env.studies.hardcases.runner import NAMED

CATALOGUE = Path(__file__).parent / "src" / "cases" / "catalogue.json"
# Cases with more scenes than this draw them at random; the page does not run these.
_MOST_SCENES = 16


class _Collector(CaseContext):
    """Keeps the scenes that a case builds, without repetitions."""

    def __init__(self, method: str) -> None:
        super().__init__(method)
        self.scenes: list[str] = []

    def scene(self, base: str | Scene, changes: Any = None) -> Scene:
        made = super().scene(base, changes)
        if made.to_toml() not in self.scenes:
            self.scenes.append(made.to_toml())
        return made


def entry(case: Case, methods: Sequence[str] = NAMED) -> dict[str, Any]:
    """Describe a case; it runs once with each accuracy. The scenes are those of the first one."""
    measured: dict[str, float] = {}
    scenes: list[str] = []
    for method in methods:
        if method in case.limits:
            context = _Collector(method)
            # Digits below these are rounding errors of the machine.
            measured[method] = float(f"{case.measure(context):.4g}")
            scenes = scenes or context.scenes
    return {
        **{key: getattr(case, key) for key in ("name", "kind", "setup", "law", "criterion")},
        "unit": case.unit,
        "limits": {method: case.limits.get(method) for method in NAMED},
        "measured": {method: measured.get(method) for method in NAMED},
        "excluded": case.excluded,
        "scenes": scenes if len(scenes) <= _MOST_SCENES else [],
    }


if __name__ == "__main__":
    entries = [entry(case) for case in CASES.values()]
    write_text(CATALOGUE, json.dumps(entries, indent=1) + "\n")
