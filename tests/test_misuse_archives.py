"""Archives from strangers: refused by their headers, in little time and memory."""

import io
import json
import struct
import subprocess
import sys
import zipfile

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from skate_env import IceSkateEnv, Policy, Simulator, load_scene, policies
from skate_env.policies import OrbitPolicy, shipped
from skate_env.replay import Recording, record

LOADERS = {"policy": Policy.load, "feedback": policies.load, "recording": Recording.load}
# Beginnings of their messages.
WHAT = {"policy": "policy", "feedback": "policy", "recording": "recording"}

# Time and peak memory of one refusal, in a process of its own.
MEASURE = """
import sys, time
from pathlib import Path
from skate_env import Policy, policies
from skate_env.replay import Recording
loaders = {"policy": Policy.load, "feedback": policies.load, "recording": Recording.load}
load = loaders[sys.argv[1]]
def peak():
    # Of this process alone; getrusage counts the memory of its parent before the start.
    return int(Path("/proc/self/status").read_text().split("VmHWM:")[1].split()[0])
try:
    load(Path(__file__))
except ValueError:
    pass
before, started = peak(), time.perf_counter()
try:
    load(Path(sys.argv[2]))
    print("accepted")
except ValueError as error:
    print(time.perf_counter() - started, peak() - before, str(error)[:100])
"""


@pytest.fixture(scope="module")
def contents(tmp_path_factory):
    """Bytes of a valid file of each kind."""
    path = tmp_path_factory.mktemp("valid") / "recording.npz"
    record(Simulator(load_scene("paper_printed")), 1, every=10).save(path)
    feedback = tmp_path_factory.mktemp("valid") / "feedback.npz"
    env = IceSkateEnv("paper", joints="all", mirrored=False)
    names = env.observation_names, env.joint_names
    d, n = len(policies.inputs(names[0])), len(names[1])
    zeros = [np.zeros(shape) for shape in ((1, d), (1, n), (1, n, d), (1, d, d))]
    OrbitPolicy(env.scene, *zeros, 1.0, dict.fromkeys(names[1], 1.0), *names, {}).save(feedback)
    return {
        "policy": shipped("paper_printed").read_bytes(),
        "feedback": feedback.read_bytes(),
        "recording": path.read_bytes(),
    }


@pytest.fixture(scope="module")
def script(tmp_path_factory):
    path = tmp_path_factory.mktemp("script") / "measure.py"
    path.write_text(MEASURE)
    return path


def changed(content, **entries):
    """Replace entries of an archive by arrays or raw bytes, or (None) leave them out."""
    with zipfile.ZipFile(io.BytesIO(content)) as archive:
        values = {entry.filename: archive.read(entry) for entry in archive.infolist()}
    for name, value in entries.items():
        values.pop(f"{name}.npy")
        if isinstance(value, np.ndarray):
            stream = io.BytesIO()
            np.lib.format.write_array(stream, value)
            value = stream.getvalue()
        if value is not None:
            values[f"{name}.npy"] = value
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, value in values.items():
            archive.writestr(name, value)
    return stream.getvalue()


def header(shape, dtype="<f8"):
    stream = io.BytesIO()
    fields = {"descr": dtype, "fortran_order": False, "shape": shape}
    np.lib.format.write_array_header_1_0(stream, fields)
    return stream.getvalue()


def bomb(content, name):
    """Let entry ``name`` unpack to 300 MB of zeros."""
    n = 300 * 2**20
    return changed(content, **{name: header((n // 8,)) + bytes(n)})


def layered(content, dtype, size, last):
    """Replace the layers of a policy by two of zeros of ``size`` bytes, the last bias by NaN."""
    policy = Policy.load(shipped("paper_printed"))
    d, n = len(policy.observation_names), len(policy.joint_names)
    width = size // np.dtype(dtype).itemsize // (d + n + 1)
    shapes = {"weight0": (width, d), "bias0": (width,), "weight1": (n, width)}
    layers = {name: np.zeros(shape, dtype) for name, shape in shapes.items()}
    return changed(content, **layers, bias1=np.full(n, np.nan, last), weight2=None, bias2=None)


def narrow(content):
    """Replace the arrays of a feedback by small types, wrong only in the last entry, of 60 MB."""
    shapes = {name: array.shape[1:] for name, array in arrays_of(content).items()}
    wide = ("references", "actions", "gains", "roots")
    m = 60 * 2**20 // sum(int(np.prod(shapes[name])) for name in wide)
    return changed(
        content,
        **{name: np.zeros((m, *shapes[name]), np.int8) for name in wide[:-1]},
        roots=np.zeros((m, *shapes["roots"]), np.bool_),
    )


def arrays_of(content):
    with np.load(io.BytesIO(content)) as archive:
        return {name: archive[name] for name in archive.files if archive[name].ndim}


def two_directories(_):
    """Make an archive of 200,000 entries, whose usual end record says one."""
    entries = bytearray()
    for i in range(200_000):
        name = b"%08d.npy" % i
        entries += b"PK\x01\x02" + struct.pack("<24xH16x", len(name)) + name
    large = b"PK\x06\x06" + struct.pack("<Q12xQQQQ", 44, *2 * [200_000], len(entries), 0)
    locator = b"PK\x06\x07" + struct.pack("<IQI", 0, len(entries), 1)
    end = b"PK\x05\x06" + struct.pack("<HHHHIIH", 0, 0, 1, 1, 100, 0, 0)
    return bytes(entries) + large + locator + end


def long_header(content):
    n = 300 * 2**20
    return changed(content, mean=b"\x93NUMPY\x02\x00" + struct.pack("<I", n) + b" " * n)


ATTACKS = {
    ("policy", "a header of 300 MB"): long_header,
    ("policy", "layers of int8"): lambda c: layered(c, "i1", 15 * 2**20, "f2"),
    ("policy", "a NaN at the end"): lambda c: layered(c, "f4", 15 * 2**20, "f4"),
    ("policy", "two directories"): two_directories,
    ("recording", "two directories"): two_directories,
    ("feedback", "narrow types"): narrow,
    ("feedback", "an array of 300 MB"): lambda content: bomb(content, "roots"),
    ("feedback", "other names"): lambda c: changed(
        c, text=np.array(str(np.load(io.BytesIO(c))["text"]).replace("support_leg", "x"))
    ),
    ("policy", "an array of 300 MB"): lambda content: bomb(content, "mean"),
    ("recording", "an array of 300 MB"): lambda content: bomb(content, "q"),
    ("recording", "a text of 300 MB"): lambda content: bomb(content, "metadata"),
    ("policy", "2**40 numbers declared"): lambda c: changed(c, mean=header((2**40,))),
    ("recording", "2**62 numbers declared"): lambda c: changed(c, t=header((2**62,))),
    ("recording", "a negative length"): lambda c: changed(c, t=header((-1,))),
    ("policy", "raw bytes"): lambda c: changed(c, mean=b"raw"),
    ("recording", "raw bytes"): lambda c: changed(c, t=b"raw"),
    ("recording", "an empty entry"): lambda c: changed(c, t=b""),
    ("policy", "a missing array"): lambda c: changed(c, mean=None),
    ("recording", "a missing array"): lambda c: changed(c, head=None),
    ("recording", "a missing text"): lambda c: changed(c, metadata=None),
    ("recording", "another type"): lambda c: changed(c, t=np.zeros(3, "f4")),
    ("recording", "another shape"): lambda c: changed(c, head=np.zeros((3, 3))),
    ("recording", "no JSON"): lambda c: changed(c, metadata=np.array("{")),
    ("recording", "no object"): lambda c: changed(c, metadata=np.array("[]")),
    ("recording", "brackets"): lambda c: changed(c, metadata=np.array("[" * 100_000)),
    ("policy", "brackets"): lambda c: changed(c, text=np.array("[" * 100_000)),
    ("recording", "no scene"): lambda c: changed(
        c,
        metadata=np.array(
            json.dumps(
                dict.fromkeys(
                    (
                        *("scene", "coordinate_names", "policy", "termination"),
                        *("wall_time", "stats", "totals"),
                    )
                )
            )
        ),
    ),
    ("policy", "nothing"): lambda c: b"",
    ("recording", "nothing"): lambda c: b"",
    ("recording", "text"): lambda c: b"hello" * 1000,
    ("recording", "a policy"): lambda c: shipped("paper_printed").read_bytes(),
    ("recording", "half a file"): lambda c: c[: len(c) // 2],
}


@pytest.mark.parametrize(("kind", "what"), ATTACKS)
def test_archives_of_strangers_are_refused_quickly(kind, what, contents, script, tmp_path):
    path = tmp_path / "attack.npz"
    path.write_bytes(ATTACKS[kind, what](contents[kind]))
    command = [sys.executable, script, kind, path]
    done = subprocess.run(command, capture_output=True, text=True, timeout=100)
    assert done.returncode == 0, done.stderr
    # Measured: at most 0.005 s, and no more memory than before the call.
    seconds, kibibytes, said = done.stdout.split(maxsplit=2)
    assert float(seconds) < 2.0 and int(kibibytes) < 64 * 1024, done.stdout
    assert said.startswith(f"{WHAT[kind]} {path}"[:30])


def test_the_text_is_checked_before_large_arrays_are_read(contents, script, tmp_path):
    n = 2**19
    wide = {name: (n, 19) for name in ("q", "v", "acceleration", "torque")}
    shapes = wide | {"t": (n,), "head": (n, 3)}
    large = {name: header(shape) + bytes(8 * int(np.prod(shape))) for name, shape in shapes.items()}
    path = tmp_path / "attack.npz"
    path.write_bytes(changed(contents["recording"], metadata=np.array("{}"), **large))
    done = subprocess.run(
        [sys.executable, script, "recording", path], capture_output=True, text=True, timeout=100
    )
    seconds, kibibytes, _ = done.stdout.split(maxsplit=2)
    assert float(seconds) < 2.0 and int(kibibytes) < 64 * 1024, done.stdout


@pytest.mark.parametrize("kind", LOADERS)
def test_a_text_has_every_name_once(kind, contents, tmp_path):
    name = "metadata" if kind == "recording" else "text"
    with np.load(io.BytesIO(contents[kind])) as archive:
        text = str(archive[name])
    path = tmp_path / "attack.npz"
    path.write_bytes(
        changed(contents[kind], **{name: np.array('{"x": {"a": 1, "a": 1}, ' + text[1:])})
    )
    with pytest.raises(ValueError, match="an object has a name twice"):
        LOADERS[kind](path)


@pytest.mark.parametrize("kind", LOADERS)
def test_many_entries_are_refused_before_the_directory_is_read(kind, tmp_path):
    path = tmp_path / "many.npz"
    with zipfile.ZipFile(path, "w") as archive:
        for i in range(20_000):
            archive.writestr(f"{i}.npy", b"")
    with pytest.raises(ValueError, match="entries"):
        LOADERS[kind](path)


@pytest.mark.parametrize("kind", LOADERS)
def test_special_files_are_refused(kind, tmp_path):
    with pytest.raises(ValueError, match="regular file"):
        LOADERS[kind](type(tmp_path)("/dev/zero"))
    with pytest.raises(OSError):
        LOADERS[kind](tmp_path)


@settings(max_examples=200, deadline=None)
@given(st.data())
@pytest.mark.parametrize("kind", LOADERS)
def test_mutated_files_are_refused_with_one_error_or_harmless(
    kind, contents, tmp_path_factory, data
):
    content = bytearray(contents[kind])
    for _ in range(data.draw(st.integers(1, 8))):
        at = data.draw(st.integers(0, len(content) - 1))
        content[at] = data.draw(st.integers(0, 255))
    cut = data.draw(st.sampled_from([0, 0, 1, 22, 100, len(content) // 2]))
    path = tmp_path_factory.getbasetemp() / f"mutated_{kind}.npz"
    path.write_bytes(content[: len(content) - cut])
    try:
        LOADERS[kind](path)
    except ValueError as error:
        assert str(error).startswith(f"{WHAT[kind]} {path}: ")


def test_archives_larger_than_2_gb_have_two_end_records(contents, tmp_path, monkeypatch):
    path = tmp_path / "large.npz"
    monkeypatch.setattr(zipfile, "ZIP64_LIMIT", 100)
    path.write_bytes(changed(contents["policy"]))
    assert b"PK\x06\x06" in path.read_bytes()
    assert Policy.load(path).joint_names == Policy.load(shipped("paper_printed")).joint_names


METADATA = {
    "wall_time": ["x", None, float("nan")],
    "stats": [[1], {"steps": "many"}],
    "totals": [None],
    "termination": [{"a": 1}],
    "policy": [[1]],
    "scene": [5, "name = 1"],
    "coordinate_names": [[], [1] * 19],
}


@pytest.mark.parametrize(
    ("name", "value"), [(name, value) for name, values in METADATA.items() for value in values]
)
def test_metadata_of_recordings_has_types(name, value, contents, tmp_path):
    metadata = json.loads(str(np.load(io.BytesIO(contents["recording"]))["metadata"]))
    path = tmp_path / "r.npz"
    text = np.array(json.dumps(metadata | {name: value}))
    path.write_bytes(changed(contents["recording"], metadata=text))
    with pytest.raises(ValueError, match=f"metadata {name}"):
        Recording.load(path)


@pytest.mark.parametrize("name", ["t", "q", "v", "head", "segments", "contact_forces"])
def test_numbers_of_recordings_are_finite(name, contents, tmp_path):
    array = arrays_of(contents["recording"])[name]
    array[-1] = np.nan
    path = tmp_path / "r.npz"
    path.write_bytes(changed(contents["recording"], **{name: array}))
    with pytest.raises(ValueError, match=rf"{name}\[.*\] = nan: must be finite"):
        Recording.load(path)


def test_times_of_recordings_increase_and_coordinates_are_those_of_the_scene(contents, tmp_path):
    arrays, path = arrays_of(contents["recording"]), tmp_path / "r.npz"
    path.write_bytes(changed(contents["recording"], t=arrays["t"][::-1]))
    with pytest.raises(ValueError, match="t: must increase"):
        Recording.load(path)
    fewer = {name: arrays[name][:, :0] for name in ("q", "v", "acceleration", "torque")}
    path.write_bytes(changed(contents["recording"], **fewer))
    with pytest.raises(ValueError, match="q: 0 columns: the scene has 19 coordinates"):
        Recording.load(path)
