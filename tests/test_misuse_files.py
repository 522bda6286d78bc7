"""Files that commands read are regular; files that they write are complete or unchanged."""

import ast
import os
import resource
import signal
import subprocess
import tempfile
import time
from pathlib import Path

import pytest

import skate_env
from skate_env import Policy, Simulator, load_scene, policies
from skate_env.common import files
from skate_env.policies import shipped
from skate_env.replay import Recording, record
from tests.commands import line

OLD = b"the old file"
COMMANDS = {
    "film.mp4": ["record", "--steps", 1, "--size", "320x200", "--out", "film.mp4"],
    "film.gif": ["record", "--steps", 1, "--fps", 10, "--size", "320x200", "--out", "film.gif"],
    "recording.npz": ["replay", "--steps", 2, "--no-figures", "--out", "."],
    "fig07_slide_distance.png": ["replay", "--steps", 2, "--out", "."],
    "gait_paper.png": ["gait", "--steps", 2, "--out", "."],
    "evaluations.png": ["stress", "--steps", 300, "--jobs", 1, "--out", "."],
    "episode_3.toml": ["stress", "--episode", 3, "--out", "."],
}
# Files of each command that are larger than this fail [bytes].
LIMITS = {"episode_3.toml": 100}


def command(arguments, folder, preexec_fn=None):
    return subprocess.Popen(
        line(*arguments),
        cwd=folder,
        env=os.environ | {"PYTHONPATH": str(ROOT)},
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        preexec_fn=preexec_fn,
    )


def limit_files(size):
    return lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (size, size))


@pytest.mark.parametrize("name", COMMANDS)
def test_a_full_disk_is_an_error_and_leaves_the_old_file(name, tmp_path):
    if name == "film.mp4":
        pytest.importorskip("imageio_ffmpeg")
    (tmp_path / name).write_bytes(OLD)
    process = command(COMMANDS[name], tmp_path, limit_files(LIMITS.get(name, 2000)))
    out, err = process.communicate(timeout=300)
    assert process.returncode == 2, (out, err)
    assert "error: " in err and "written to" not in out and "Traceback" not in err
    assert (tmp_path / name).read_bytes() == OLD
    assert not list(tmp_path.glob(".*"))


@pytest.mark.parametrize("name", ["film.mp4", "film.gif"])
@pytest.mark.parametrize(("number", "status"), [(signal.SIGTERM, 143), (signal.SIGKILL, -9)])
def test_a_signal_leaves_the_old_film(name, number, status, tmp_path):
    if name == "film.mp4":
        pytest.importorskip("imageio_ffmpeg")
    (tmp_path / name).write_bytes(OLD)
    process = command([*COMMANDS[name], "--slow", 1000], tmp_path)
    deadline = time.monotonic() + 60.0
    while not list(tmp_path.glob(".*.part*")) and time.monotonic() < deadline:
        time.sleep(0.05)
    time.sleep(1.0)
    process.send_signal(number)
    process.communicate(timeout=60)
    assert process.returncode == status
    assert (tmp_path / name).read_bytes() == OLD
    # Nobody can remove the temporary file of a killed process.
    assert number == signal.SIGKILL or not list(tmp_path.glob(".*"))


def test_a_vanished_folder_is_an_error(tmp_path):
    folder = tmp_path / "folder"
    folder.mkdir()
    process = command([*COMMANDS["film.gif"][:-1], folder / "film.gif"], tmp_path)
    deadline = time.monotonic() + 60.0
    while not list(folder.glob(".*.part*")) and time.monotonic() < deadline:
        time.sleep(0.02)
    for path in folder.iterdir():
        path.unlink()
    folder.rmdir()
    out, err = process.communicate(timeout=120)
    assert process.returncode == 2 and "written to" not in out, (out, err)


def everything():
    """All functions that write a file, by name."""
    policy = Policy.load(shipped("paper_printed"))
    recording = record(Simulator(load_scene("paper_printed")), 1)
    return {
        "policy": policy.save,
        "recording": recording.save,
        "steps": recording.save_steps,
        "text": lambda path: files.write_text(path, "text" * 1000),
    }


@pytest.mark.parametrize("name", ["policy", "recording", "steps", "text"])
def test_writing_is_atomic(name, tmp_path):
    write, path = everything()[name], tmp_path / "file"
    write(path)
    content = path.read_bytes()
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    # Ignored by Python, so that writing raises an OSError.
    try:
        resource.setrlimit(resource.RLIMIT_FSIZE, (20, before[1]))
        with pytest.raises(OSError, match="large"):
            write(path)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
    assert path.read_bytes() == content and os.listdir(tmp_path) == ["file"]
    for wrong in (tmp_path, tmp_path / "no" / "folder"):
        with pytest.raises(OSError):
            write(wrong)
    with pytest.raises(OSError, match="regular"):
        write(type(path)("/dev/null"))


@pytest.fixture
def own_folder():
    """Give a folder of a user without privileges; root, who writes everywhere, becomes the user."""
    user, other = os.geteuid(), 65534
    with tempfile.TemporaryDirectory() as folder:
        if user == 0:
            os.chown(folder, other, -1)
            os.seteuid(other)
        try:
            yield Path(folder)
        finally:
            os.seteuid(user)


def test_a_read_only_folder_is_an_error(own_folder):
    files.write_text(own_folder / "file", "text")
    own_folder.chmod(0o500)
    with pytest.raises(PermissionError):
        files.write_text(own_folder / "file", "other")
    assert (own_folder / "file").read_text() == "text" and os.listdir(own_folder) == ["file"]
    own_folder.chmod(0o700)


def test_a_link_keeps_its_place_and_permissions_are_usual(tmp_path):
    (tmp_path / "link").symlink_to(tmp_path / "file")
    files.write_text(tmp_path / "link", "text")
    assert (tmp_path / "link").is_symlink() and (tmp_path / "file").read_text() == "text"
    (tmp_path / "other").touch()
    assert (tmp_path / "file").stat().st_mode == (tmp_path / "other").stat().st_mode


def test_recordings_are_written_to_the_very_path(tmp_path):
    recording = record(Simulator(load_scene("paper_printed")), 1)
    recording.save(tmp_path / "no_suffix")
    assert Recording.load(tmp_path / "no_suffix").t.tolist() == recording.t.tolist()


ROOT = Path(__file__).parents[1]
# Methods of other objects than `files` that write a file, and the modules that may call them: for
# streams in memory, and for files in temporary folders.
WRITERS = {"savefig", "write_text", "write_bytes", "savez", "savez_compressed", "tofile"}
OWN = {
    "skate_env/common/files.py",
    "skate_env/common/npz.py",
    "skate_env/replay/page.py",
    "skate_env/studies/callgrind.py",
}


def direct_writes(path):
    """Yield the lines of a module that write a file themselves."""
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if not isinstance(node, ast.Call):
            continue
        name = getattr(node.func, "attr", getattr(node.func, "id", ""))
        owner = getattr(getattr(node.func, "value", None), "id", "")
        texts = [x.value for x in ast.walk(node) if isinstance(x, ast.Constant)]
        opens = name == "open" and any(isinstance(x, str) and set(x) & set("wax+") for x in texts)
        called = isinstance(node.func, ast.Attribute) and owner != "files"
        if opens or (called and name in WRITERS) or (owner, name) == ("np", "save"):
            yield f"{path.relative_to(ROOT)}:{node.lineno}: {ast.unparse(node)[:60]}"


def test_every_file_is_written_atomically():
    found = []
    for folder in (Path(skate_env.__file__).parent, ROOT / "training"):
        for path in sorted(folder.rglob("*.py")):
            if path.relative_to(ROOT).as_posix() not in OWN:
                found += direct_writes(path)
    assert not found


def test_files_that_belong_together_are_replaced_together(tmp_path):
    paths = [tmp_path / name for name in ("a", "b", "c")]
    paths[0].write_text("old")
    paths[1].symlink_to("/dev/full")
    with pytest.raises(OSError, match="b: not a regular file"):
        files.write_all(dict.fromkeys(paths, b"new"))
    assert paths[0].read_text() == "old" and sorted(os.listdir(tmp_path)) == ["a", "b"]


def test_targets_are_checked_without_a_trace(own_folder):
    files.prepare_file(own_folder / "new" / "file")
    files.prepare_folder(own_folder / "folder")
    assert sorted(x.name for x in own_folder.rglob("*")) == ["folder", "new"]
    for wrong in (own_folder, Path("/dev/full"), Path("/proc/no")):
        with pytest.raises(OSError):
            files.prepare_file(wrong)
    with pytest.raises(OSError):
        files.prepare_folder(Path("/dev/full"))
    own_folder.chmod(0o500)
    with pytest.raises(PermissionError):
        files.prepare_folder(own_folder)
    own_folder.chmod(0o700)


READERS = {
    "policy": Policy.load,
    "feedback": policies.load,
    "recording": Recording.load,
    "scene": load_scene,
}


@pytest.fixture
def patience():
    """Interrupt a test that waits for a named pipe, or reads a device."""

    def end(*_):
        raise TimeoutError

    before = signal.signal(signal.SIGALRM, end)
    signal.alarm(5)
    yield
    signal.alarm(0)
    signal.signal(signal.SIGALRM, before)


@pytest.mark.parametrize("kind", READERS)
def test_special_files_are_refused_at_once(kind, tmp_path, patience):
    pipe, device = tmp_path / "pipe.toml", tmp_path / "device.toml"
    os.mkfifo(pipe)
    device.symlink_to("/dev/zero")
    for path in (pipe, device):
        with pytest.raises(ValueError, match=f"{path.name}.*: not a regular file"):
            READERS[kind](path)


def test_checkpoints_are_regular_files(tmp_path, patience):
    checkpoint = pytest.importorskip("skate_env.learning.checkpoint", exc_type=ImportError)
    os.mkfifo(tmp_path / "checkpoint")
    with pytest.raises(ValueError, match="checkpoint: not a regular file"):
        checkpoint.load(tmp_path / "checkpoint")


def test_a_large_scene_is_refused_before_it_is_read(tmp_path):
    path = tmp_path / "large.toml"
    path.touch()
    os.truncate(path, 300 * 2**20)
    with pytest.raises(ValueError, match="314572800 bytes: at most 1048576 are possible"):
        load_scene(path)
    text = load_scene("paper").to_toml()
    path.write_text(text + "#" * (2**20 - len(text.encode())), encoding="utf-8")
    assert load_scene(path) == load_scene("paper")


def test_names_of_files_stay_in_their_folder():
    assert files.plain_name("../a b/\\ü\0.png") == ".._a_b____.png"
    assert len(files.plain_name(1000 * "a")) == 100
