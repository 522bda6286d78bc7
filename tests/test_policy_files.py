"""Policy files are read as they were written, or refused with a clear message."""

import json
from io import BytesIO

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays

from skate_env import Policy, load_scene


@pytest.fixture(scope="module")
def file(random_policy, tmp_path_factory):
    path = tmp_path_factory.mktemp("policies") / "good.npz"
    random_policy().save(path)
    return path


@pytest.fixture(scope="module")
def parts(file):
    """Arrays and text of a valid file."""
    with np.load(file) as archive:
        values = dict(archive)
    return values, json.loads(str(values.pop("text")))


def packed(values, text):
    stream = BytesIO()
    text = text if isinstance(text, str) else json.dumps(text)
    np.savez_compressed(stream, **values, text=np.array(text))
    return stream.getvalue()


def told(path, content):
    """Load an invalid file, which must raise a plain ValueError; return its message."""
    path.write_bytes(content)
    with pytest.raises(ValueError) as refusal:
        Policy.load(path)
    assert type(refusal.value) is ValueError and len(str(refusal.value)) < 2000
    said = str(refusal.value)
    assert said.startswith(f"policy {path}: ")
    return said.removeprefix(f"policy {path}: ")


def test_arrays_are_numbers_and_the_rest_is_one_text(parts, file):
    values, text = parts
    names = {"log_std", "mean", "std", "clip", "action_scale"}
    assert set(values) == names | {f"{x}{i}" for x in ("weight", "bias") for i in range(3)}
    assert {values[name].dtype.kind for name in values} == {"f"}
    assert values["weight1"].shape == (24, 32) and values["weight1"].dtype == np.float32
    assert set(text) == {"format", "kind", "scene", "observation_names", "joint_names", "about"}
    assert text["format"] == 1 and text["kind"] == "network"
    assert text["about"] == Policy.load(file).about
    # Weights of 14 kB, names, a scene.
    assert file.stat().st_size < 30_000


BYTES = {
    "empty": b"",
    "text": b"policy = 'good'",
    "pickle": b"\x80\x04\x95\x0c\x00\x00\x00\x00\x00\x00\x00\x8c\x08builtins.",
    "zip of nothing": b"PK\x05\x06" + bytes(18),
}


@pytest.mark.parametrize("content", BYTES.values(), ids=BYTES.keys())
def test_other_files_are_refused(content, tmp_path):
    assert told(tmp_path / "p.npz", content)


def test_one_array_alone_is_refused(tmp_path):
    stream = BytesIO()
    np.save(stream, np.zeros(3))
    assert told(tmp_path / "p.npz", stream.getvalue()) == "not an .npz file"


def test_pickled_objects_are_not_unpacked(parts, tmp_path):
    values, text = parts
    content = packed(values | {"mean": np.array([print], dtype=object)}, text)
    assert "holds Python objects" in told(tmp_path / "p.npz", content)


def test_files_that_cannot_be_read_are_refused(tmp_path):
    for path in (tmp_path / "missing.npz", tmp_path):
        with pytest.raises(OSError, match=path.name):
            Policy.load(path)


def test_missing_and_extra_arrays_are_named(parts, tmp_path):
    values, text = parts
    path = tmp_path / "p.npz"
    for name in values:
        less = {key: value for key, value in values.items() if key != name}
        said = told(path, packed(less, text))
        # Without one weight the last layer is missing its number.
        assert f"array '{name}' is missing" in said or "'weight" in said or "'bias2'" in said
    for name in text.keys() - {"kind"}:
        less = {key: value for key, value in text.items() if key != name}
        known = "unknown format" if name == "format" else f"part of the text '{name}' is missing"
        assert known in told(path, packed(values, less))
    assert "unknown array 'more'" in told(path, packed(values | {"more": np.zeros(2)}, text))
    assert "unknown part of the text 'more'" in told(path, packed(values, text | {"more": 1}))
    for format in (2, "1", None, 1.5):
        assert "unknown format" in told(path, packed(values, text | {"format": format}))
    for kind in ("tree", None, [], 1):
        assert "kind" in told(path, packed(values, text | {"kind": kind}))
    for wrong in ("", "{", "[1]", "null", "[" * 100_000):
        assert told(path, packed(values, wrong))


def test_files_of_the_first_version_name_no_kind(parts, file, tmp_path):
    values, text = parts
    path = tmp_path / "p.npz"
    path.write_bytes(packed(values, {key: text[key] for key in text.keys() - {"kind"}}))
    np.testing.assert_array_equal(Policy.load(path).mean, Policy.load(file).mean)


def test_mismatching_arrays_are_refused_with_the_file_name(parts, tmp_path):
    values, text = parts
    path = tmp_path / "p.npz"
    nan = values | {"weight0": np.full((32, 76), np.nan, np.float32)}
    assert "weight0[0, 0] = nan: must be finite" in told(path, packed(nan, text))
    other = text | {"scene": load_scene("paper_printed").without("arms").to_toml()}
    assert "joint_names[9] is 'q11'" in told(path, packed(values, other))
    assert "colour: unknown field" in told(path, packed(values, text | {"scene": "colour = 1"}))


@settings(max_examples=150, deadline=None)
@given(st.data())
def test_damaged_bytes_are_refused_or_harmless(file, tmp_path_factory, data):
    content = bytearray(file.read_bytes())
    for _ in range(data.draw(st.integers(1, 4))):
        place = data.draw(st.integers(0, len(content) - 1))
        content[place] = data.draw(st.integers(0, 255))
    end = data.draw(st.sampled_from([len(content), data.draw(st.integers(0, len(content)))]))
    check(tmp_path_factory, bytes(content[:end]))


ANYTHING = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats(allow_nan=False) | st.text(max_size=8),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=8), inner),
    max_leaves=8,
)
ARRAYS = arrays.arrays(
    st.sampled_from([np.float32, np.float64, np.int64, np.bool_, np.complex128, "U3", ">f4"]),
    st.lists(st.sampled_from([0, 1, 16, 24, 32, 76]), max_size=3).map(tuple),
)


@settings(max_examples=150, deadline=None)
@given(st.data())
def test_other_contents_are_refused_or_harmless(parts, tmp_path_factory, data):
    values, text = (dict(part) for part in parts)
    if data.draw(st.booleans()):
        values[data.draw(st.sampled_from(sorted(values)))] = data.draw(ARRAYS)
    else:
        text[data.draw(st.sampled_from(sorted(text)))] = data.draw(ANYTHING)
    check(tmp_path_factory, packed(values, text))


def check(tmp_path_factory, content):
    path = tmp_path_factory.getbasetemp() / "anything.npz"
    path.write_bytes(content)
    try:
        policy = Policy.load(path)
    except ValueError as refusal:
        assert type(refusal) is ValueError and str(path) in str(refusal)
        return
    action, _ = policy.predict(np.ones(76, np.float32))
    assert action.shape == (16,) and np.all(np.abs(action) <= 1.0)
