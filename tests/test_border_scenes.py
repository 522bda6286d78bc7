"""Invalid scenes, as text and as changes of fields, are refused with the field's name."""

import json
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from skate_env import Scene, load_scene
from skate_env.scenes import replace

WRONG_JSON = {
    "nothing": ("", "not JSON"),
    "cut": ('{"ice": ', "not JSON"),
    "binary": ("\0\1\2", "not JSON"),
    "deep": ("[" * 100_000, "not JSON"),
    "too large": ('{"ice": {"gravity": 1e400}}', "not JSON: number out of range"),
    "nan": ('{"ice": {"gravity": NaN}}', "not JSON"),
    "null": ("null", "null"),
    "no table": ("3", "integer `3`"),
    "unknown": ('{"ise": {}}', "ise: unknown field"),
    "word": ('{"ice": {"gravity": "9"}}', "ice.gravity = "),
    "bool": ('{"ice": {"gravity": true}}', "ice.gravity = true"),
    "no scene without": ('{"ice": null}', "ice"),
    # The fields of a list have no names, so their ranges are unknown.
    "list": ('{"ice": [1e9, {"kind": "none"}]}', "ice.gravity = 1000000000"),
    "list of gains": ('{"control": {"lifting": [[1e300, 0, 0], 0, 0]}}', "K_p.0 = 1e300"),
    "list of starts": ('{"start": ["right", {"q2": 1e300}, {}]}', "start.q.q2 = 1e300"),
    "start": ('{"start": {"q": {"q99": 1.0}}}', "start.q.q99: unknown"),
    "twice": ('{"name": "a", "name": "b"}', 'not JSON: "name" occurs twice at line 1'),
    "twice inside": ('{"ice": [{"gravity": 1, "gravity": 1}]}', '"gravity" occurs twice'),
    "two scenes": ("{} {}", "not JSON: trailing characters"),
}
WRONG_TOML = {
    "binary": ("\0\1\2", "not TOML at line 1"),
    "cut": ("name = 'x'\n[ice", "not TOML at line 2"),
    "one endless word": ("a" * 100_000, "not TOML at line 1, column 100001"),
    "deep": ("a = " + "[" * 100_000, "not TOML"),
    "twice": ("[ice]\n[ice]", "not TOML at line 2"),
    "nan": ("[ice]\ngravity = nan", "ice.gravity = NaN: must lie in [0, 100] m/s2"),
    "inf": ("[start.v]\nq2 = -inf", "start.v.q2 = -inf: must lie in [-1000000, 1000000] rad/s"),
    "in a list": ("[control.lifting]\nK_p = [0.0, nan, 0.0]", "K_p.1 = NaN"),
    "1e999": ("[ice]\ngravity = 1e999", "not TOML at line 2, column 11"),
    "1e300": ("[ice]\ngravity = 1e300", "ice.gravity = 1e300: must lie in [0, 100] m/s2"),
    "subnormal": ("[body.head]\nmass = 5e-324", "body.head.mass = 5e-324: must lie in"),
    "accuracy": ("accuracy = 'sloppy'", "accuracy: must be fast, balanced, reference"),
    "step": ("accuracy = { method = 'moreau', step = 0.0 }", "accuracy.step = 0: must lie in"),
}


@pytest.mark.parametrize("wrong", WRONG_JSON)
def test_wrong_json_is_refused(refused, wrong):
    text, says = WRONG_JSON[wrong]
    refused(ValueError, lambda: Scene.from_json(text), says)


@pytest.mark.parametrize("wrong", WRONG_TOML)
def test_wrong_toml_is_refused(refused, wrong):
    text, says = WRONG_TOML[wrong]
    refused(ValueError, lambda: Scene.from_toml(text), says)


JSON = st.recursive(
    st.none() | st.booleans() | st.floats() | st.integers() | st.text(max_size=5),
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text(max_size=3), inner),
    max_leaves=8,
)
FIELDS = [*sorted(load_scene("paper").parameters()), "ice", "ice.friction", "start", "locked"]


@settings(max_examples=150, deadline=None)
@given(st.sampled_from(FIELDS), JSON)
def test_any_value_in_any_field_is_a_scene_or_refused(name, value):
    scene = load_scene("paper")
    try:
        changed = replace(scene, {name: value})
    except ValueError as refusal:
        assert name.split(".")[0] in str(refusal)
        return
    assert Scene.from_toml(changed.to_toml()).to_toml() == changed.to_toml()
    for number, (x, low, high, _) in changed.parameters().items():
        assert low <= x <= high, number


@pytest.mark.parametrize(
    ("changes", "kind", "words"),
    [
        ({"ice.gravity": math.nan}, ValueError, ["ice.gravity = nan", "finite"]),
        ({"ice.gravity": np.zeros(2)}, TypeError, ["ice.gravity = array", "not JSON"]),
        ({"locked": {"q11"}}, TypeError, ["locked = {'q11'}"]),
        ({1: 2.0}, TypeError, ["field 1", "must be a str, not int"]),
        ({"name.x": 1}, ValueError, ["name.x", "not a table"]),
        ({"": 1}, ValueError, ["unknown field"]),
    ],
)
def test_wrong_changes_are_refused(refused, changes, kind, words):
    refused(kind, lambda: replace(load_scene("paper"), changes), *words)


def test_damaged_json_of_a_scene_is_a_scene_or_refused():
    text = load_scene("paper").to_json()
    rng = np.random.default_rng(0)
    for _ in range(300):
        at = int(rng.integers(len(text)))
        damaged = text[:at] + chr(rng.integers(32, 127)) + text[at + 1 :]
        try:
            fields = json.loads(Scene.from_json(damaged).to_json())
        except ValueError as refusal:
            assert str(refusal)
        else:
            assert set(fields) == set(json.loads(text))
