"""The page's list of hard cases is that of the package: ``make cases`` renews it."""

import importlib.util
import json
from pathlib import Path

import pytest

from skate_env import Scene
from skate_env.studies.hardcases.case import CaseContext
from skate_env.studies.hardcases.catalogue import CASES

SCRIPT = Path(__file__).parents[1] / "web" / "catalogue.py"


@pytest.fixture(scope="module")
def script():
    spec = importlib.util.spec_from_file_location("web_catalogue", SCRIPT)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture(scope="module")
def listed(script):
    return json.loads(script.CATALOGUE.read_text(encoding="utf-8"))


def same(one, other):
    """Whether two values of JSON are equal, numbers to rounding errors of a library."""
    if isinstance(one, dict):
        return one.keys() == other.keys() and all(same(one[key], other[key]) for key in one)
    if isinstance(one, float):
        return one == pytest.approx(other, rel=1e-12, abs=0.0)
    return one == other


def test_texts_and_limits_are_those_of_the_package(script, listed):
    assert [each["name"] for each in listed] == list(CASES)
    for each in listed:
        case = CASES[each["name"]]
        for key in ("kind", "setup", "law", "criterion", "unit", "excluded"):
            assert each[key] == getattr(case, key), f"{case.name}: {key}: run make cases"
        limits = {method: case.limits[method] for method in script.NAMED if method in case.limits}
        assert each["limits"] == limits, f"{case.name}: run make cases"
        assert each["measured"].keys() == limits.keys()
        assert all(0.0 <= value <= limits[method] for method, value in each["measured"].items())


@pytest.mark.long("every case once, for the scenes that it builds")
def test_scenes_are_those_of_the_package(script, listed):
    for each in listed:
        case = CASES[each["name"]]
        context = CaseContext("balanced")
        case.measure(context)
        texts = [script.scene_of(case, context), each["scene"]]
        own, other = (text and json.loads(Scene.from_toml(text).to_json()) for text in texts)
        assert same(own, other), f"{case.name}: run make cases"
