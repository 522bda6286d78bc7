"""Write the catalogue of the hard cases for the page: texts, limits, measured values, scenes.

``python web/catalogue.py`` renews web/src/cases.json, one line for each case.
"""

import json
from pathlib import Path
from typing import Any

from skate_env.common import write_text
from skate_env.studies.hardcases.case import Case, CaseContext
from skate_env.studies.hardcases.catalogue import CASES
from skate_env.studies.hardcases.runner import NAMED

CATALOGUE = Path(__file__).parent / "src" / "cases.json"

# Cases that draw or compute their starts or torques: no scene shows them.
_NOT_PLAYED = {
    "painleve_heel",
    "painleve_two_answers",
    "painleve_near",
    "feet_that_block",
    "dragged_heel",
    "slide_to_rest",
    "very_rough_ice",
    "friction_only_takes",
    "landing_named_from_the_other_foot",
    "letting_go",
    "violent_torques",
    "mirrored",
    "pulled_landing",
    "pulled_free_foot",
    "wedged_foot",
    "upside_down",
    "visited_start",
    "thrust_from_inside",
}
# Which of its scenes the page plays, where it is not the first one.
_PLAYED = {"subnormal_speed": 1, "nearly_straight": 10, "hasty_controller": 1, "stiff_head": 1}


def scene_of(case: Case, context: CaseContext) -> str | None:
    """Return the scene that the page plays, of those that the case built, as TOML."""
    if case.name in _NOT_PLAYED:
        return None
    built = list(dict.fromkeys(scene.to_toml() for scene in context.scenes))
    return built[_PLAYED.get(case.name, 0)]


def entry(case: Case) -> dict[str, Any]:
    """Describe a case; it runs once with each accuracy."""
    contexts = {method: CaseContext(method) for method in NAMED if method in case.limits}
    # Digits below these are rounding errors of the machine.
    measured = {
        method: float(f"{case.measure(context):.4g}") for method, context in contexts.items()
    }
    return {
        **{key: getattr(case, key) for key in ("name", "kind", "setup", "law", "criterion")},
        "unit": case.unit,
        "limits": {method: case.limits[method] for method in contexts},
        "measured": measured,
        "excluded": case.excluded,
        "scene": scene_of(case, contexts["balanced"]),
    }


if __name__ == "__main__":
    lines = ",\n".join(json.dumps(entry(case)) for case in CASES.values())
    write_text(CATALOGUE, f"[\n{lines}\n]\n")
