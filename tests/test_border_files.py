"""Invalid files and options, on the command line and in `load_scene`."""

import os

import pytest

from skate_env import Simulator, load_scene
from tests.commands import invoke

# Contents of invalid scene files, and the expected messages.
CONTENTS = {
    "binary": (b"\x89PNG\r\n\x1a\n\0\xff", "not a text file"),
    "utf-16": ("name = 'x'".encode("utf-16"), "not a text file"),
    "zeros": (bytes(100), "not TOML"),
    "cut": (b"[ice]\ngravity = ", "not TOML at line 2"),
    "json": (b'{"ice": {}}', "not TOML"),
    "unknown field": (b"colour = 'red'", "colour: unknown field"),
    "nan": (b"[ice]\ngravity = nan", "ice.gravity = NaN: must lie in [0, 100] m/s2"),
    "out of range": (b"[ice]\ngravity = 1e300", "ice.gravity = 1e300: must lie in [0, 100] m/s2"),
}


def command(*arguments):
    done = invoke(*arguments)
    assert "Traceback" not in done.output
    assert done.exception is None or isinstance(done.exception, SystemExit), done.exception
    return done


@pytest.fixture(params=CONTENTS)
def damaged(request, tmp_path):
    content, says = CONTENTS[request.param]
    path = tmp_path / "scene.toml"
    path.write_bytes(content)
    return path, says


def test_damaged_files_are_refused(damaged, tmp_path):
    path, says = damaged
    for load in (load_scene, Simulator):
        with pytest.raises(ValueError) as refusal:
            load(path)
        assert type(refusal.value) is ValueError
        assert str(path) in str(refusal.value) and says in str(refusal.value)
    for arguments in (
        ("replay", "--scene", path, "--steps", 1, "--out", tmp_path / "out"),
        ("effects", "--scene", path, "--list"),
    ):
        done = command(*arguments)
        assert done.exit_code == 2
        assert says in done.output and "scene.toml" in done.output
    assert not (tmp_path / "out").exists()


def test_files_that_cannot_be_read_are_refused(tmp_path):
    folder = tmp_path / "folder.toml"
    folder.mkdir()
    locked = tmp_path / "locked.toml"
    locked.touch(mode=0o000)
    paths = [tmp_path / "missing.toml", folder, tmp_path / ("long" * 100 + ".toml")]
    if not os.access(locked, os.R_OK):  # The administrator can read every file.
        paths.append(locked)
    for path in paths:
        with pytest.raises(OSError, match=str(path)):
            load_scene(path)
        done = command("replay", "--scene", path, "--out", tmp_path / "out")
        assert done.exit_code == 2 and "error:" in done.output
    with pytest.raises(ValueError, match="null"):
        load_scene("a\0.toml")


def test_an_empty_file_is_the_default_scene(tmp_path):
    path = tmp_path / "empty.toml"
    path.touch()
    assert load_scene(path).name == "standing"


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (("--perturb", "nan"), "perturb"),
        (("--perturb", "inf"), "--perturb"),
        (("--perturb", -1), "--perturb"),
        (("--steps", 0), "--steps"),
        (("--steps", 1.5), "--steps"),
        (("--seed", -1), "--seed"),
        (("--scene", ""), "no scene ''"),
        (("--scene", "../paper"), "no scene '../paper'"),
        (("--scene", 7), "no scene '7'"),
        (("--set", "ice.gravity"), "NAME=VALUE"),
        (("--set", "=1"), "unknown field"),
        (("--set", "ice.gravity=NaN"), "ice.gravity"),
        (("--set", "ice.gravity=1e999"), "ice.gravity = inf: must be finite"),
        (("--set", "ice.gravity=1e300"), "ice.gravity = 1e300: must lie in [0, 100] m/s2"),
        (("--without", "nope"), 'effect "nope": unknown'),
        (("--with", ""), 'effect "": unknown'),
        (("--accuracy", "1e-300"), "accuracy = 1e-300: must lie in [1e-13, 0.01]"),
        (("--accuracy", '{"method": "rk4"}'), "accuracy"),
        (("--torque", "tau9"), "tau9"),
        (("--nonsense",), "--nonsense"),
    ],
)
def test_wrong_options_of_replay_are_refused(arguments, says, tmp_path):
    base = ["replay", "--no-figures", "--out", tmp_path / "out"]
    if "--steps" not in arguments:
        base += ["--steps", 1]
    done = command(*base, *arguments)
    assert done.exit_code == 2
    assert says in " ".join(done.output.split())


@pytest.mark.parametrize("name", ["replay", "effects", "accuracy", "stress"])
def test_an_output_folder_that_is_a_file_is_refused(name, tmp_path):
    file = tmp_path / "file"
    file.write_text("mine")
    done = command(name, "--out", file)
    assert done.exit_code == 2 and "error:" in done.output
    assert file.read_text() == "mine"


@pytest.mark.parametrize(
    "arguments",
    [("effects", "--scene", "nope"), ("accuracy", "--scene", "nope"), ("nonsense",)],
)
def test_unknown_names_are_refused(arguments):
    done = command(*arguments)
    assert done.exit_code == 2
    assert arguments[-1] in done.output
