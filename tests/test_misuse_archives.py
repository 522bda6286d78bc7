"""Archives from strangers: refused by their headers, in little time and memory."""

import io
import json
import subprocess
import sys
import zipfile

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from skate_env import Policy, Simulator, load_scene
from skate_env.policy import shipped
from skate_env.recording import Recording, record

LOADERS = {"policy": Policy.load, "recording": Recording.load}

# Time and peak memory of one refusal, in a process of its own.
MEASURE = """
import resource, sys, time
from pathlib import Path
from skate_env.policy import Policy
from skate_env.recording import Recording
load = {"policy": Policy.load, "recording": Recording.load}[sys.argv[1]]
def peak():
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
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
    record(Simulator(load_scene("paper_long_blade")), 1, every=10).save(path)
    return {"policy": shipped("paper_long_blade").read_bytes(), "recording": path.read_bytes()}


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


ATTACKS = {
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
    ("recording", "a policy"): lambda c: shipped("paper_long_blade").read_bytes(),
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
    assert said.startswith(f"{kind} {path}"[:30])


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
        assert str(error).startswith(f"{kind} {path}: ")
