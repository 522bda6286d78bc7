"""The command line."""

import csv
import json
import os
import subprocess
import sys
from pathlib import Path

import pytest
from typer.testing import CliRunner

import skate_env
from skate_env import scene_names
from skate_env.cli import app
from skate_env.replay import Recording
from tests.commands import line

FIGURES = {
    "fig05_screenshots.png",
    "fig06_free_foot_height.png",
    "fig07_slide_distance.png",
    "fig08_step_period.png",
    "fig09_arms_without_tau8.png",
    "fig10_arms_with_tau8.png",
    "fig11_interference_torque.png",
}


# Libraries of the extra `train`.
EXTRAS = {"scipy", "stable_baselines3", "torch"}


def run(*arguments):
    return CliRunner().invoke(app, [str(argument) for argument in arguments])


def replay(out, *arguments, steps=2):
    """Replay without figures; returns the JSON object."""
    result = run("replay", "--out", out, "--steps", steps, "--json", "--no-figures", *arguments)
    assert result.exit_code == 0, result.output
    return json.loads(result.stdout.splitlines()[-1])


def test_replay_leaves_table_recording_and_figures(tmp_path):
    out = tmp_path / "new" / "folder"
    command = [sys.executable, "-m", "skate_env", "replay", "--steps", "2", "--json", "--out", out]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    said = json.loads(done.stdout.splitlines()[-1])
    assert {path.name for path in out.iterdir()} == FIGURES | {"steps.csv", "recording.npz"}
    for name in FIGURES:
        assert (out / name).read_bytes().startswith(b"\x89PNG")
    recording = Recording.load(out / "recording.npz")
    assert said["steps"] == len(said["slide_per_step"]) == len(said["period"]) == 2
    assert said["slide_per_step"] == recording.steps["slide"].tolist()
    assert said["state_sequence"] == recording.state_sequence()
    assert said["lowest_head"] <= recording.head[:, 2].min()
    assert 0.0 <= said["inadmissible_fraction"] <= 1.0
    assert said["termination"] is None
    with (out / "steps.csv").open(newline="", encoding="utf-8") as file:
        assert len(list(csv.reader(file))) == 1 + 2
    # Progress bars are shown on terminals only.
    assert done.stderr == ""


def test_summary_is_text_without_json(tmp_path):
    result = run("replay", "--out", tmp_path, "--steps", 1, "--no-figures")
    assert result.exit_code == 0
    for word in ("slide per step", "period", "lowest head", "inadmissible", "real time"):
        assert word in result.stdout


def test_same_command_gives_the_same_numbers(tmp_path):
    first = replay(tmp_path, "--perturb", 0.01, "--seed", 3)
    again = replay(tmp_path, "--perturb", 0.01, "--seed", 3)
    other = replay(tmp_path, "--perturb", 0.01, "--seed", 4)
    assert first["period"] == again["period"] != other["period"]


@pytest.mark.parametrize(
    "choice",
    [
        ("--set", "ice.friction.mu_forward=0.25"),
        ("--accuracy", "1e-8"),
        ("--torque", "tau8"),
        ("--set", 'control.arm_swing={"amplitude": 30.0}'),
    ],
)
def test_choice_reaches_the_simulation(tmp_path, choice):
    assert replay(tmp_path, *choice)["period"] != replay(tmp_path)["period"]


def test_torque_is_the_field_it_stands_for(tmp_path):
    by_flag = replay(tmp_path, "--torque", "tau8")
    by_field = replay(tmp_path, "--set", "control.arm_swing.amplitude=30.0")
    assert by_flag["period"] == by_field["period"]


def test_fall_is_a_result_not_an_error(tmp_path):
    said = replay(tmp_path, "--set", "fall.head_height=2.9")
    assert said["termination"] == "fall" and said["steps"] == 0
    assert said["state_sequence"] == [] and said["inadmissible_fraction"] is None


@pytest.mark.filterwarnings("error")
def test_figures_are_drawn_of_a_fall_too(tmp_path):
    result = run("replay", "--out", tmp_path, "--set", "fall.head_height=2.9")
    assert result.exit_code == 0, result.output
    assert {path.name for path in tmp_path.iterdir()} >= FIGURES


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["--scene", "papier"], "papier"),
        (["--scene", "missing.toml"], "missing.toml"),
        (["--set", "ice.friction.mu=1"], "mu_forward"),
        (["--set", "ice.friction.mu_forward"], "NAME=VALUE"),
        (["--set", "ice.friction.mu_forward=-1"], "ice.friction.mu_forward"),
        (["--set", "ice.friction.mu_forward=NaN"], "ice.friction.mu_forward"),
        (["--accuracy", "perfect"], "accuracy"),
        (["--perturb", "inf"], "perturb"),
    ],
)
def test_mistake_is_one_clear_line_and_exit_code_2(tmp_path, arguments, said):
    result = run("replay", "--out", tmp_path, *arguments)
    assert result.exit_code == 2
    last = result.stderr.strip().splitlines()[-1]
    assert last.lower().startswith("error: ") and said in last
    assert "Traceback" not in result.output


def test_scenes_are_listed_with_their_provenance():
    result = run("scenes")
    assert result.exit_code == 0
    lines = result.stdout.splitlines()
    names = [i for i, line in enumerate(lines) if not line.startswith(" ")]
    assert [lines[i] for i in names] == scene_names()
    assert all(lines[i + 2].startswith("    from: ") for i in names)


@pytest.mark.parametrize("command", [each.callback.__name__ for each in app.registered_commands])
def test_help_shows_examples(command):
    result = run(command, "--help")
    assert result.exit_code == 0
    assert result.stdout.count(f"\n    skate-env {command} ") >= (0 if command == "scenes" else 2)


LOADED = """
import sys
import skate_env
from skate_env.cli import app
app({arguments}, standalone_mode=False)
print(*sys.modules, sep="\\n")
"""


@pytest.mark.parametrize("arguments", [["--help"], ["accuracy", "--help"], ["train", "--help"]])
def test_help_loads_neither_studies_nor_large_libraries(arguments):
    code = LOADED.format(arguments=arguments)
    command = [sys.executable, "-c", code]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    loaded = set(done.stdout.splitlines())
    assert "skate_env.cli" in loaded
    assert not [name for name in loaded if name.startswith("skate_env.studies")]
    roots = {name.partition(".")[0] for name in loaded}
    # The registration imports gymnasium, which imports numpy; tqdm is small.
    assert not roots & {"matplotlib", "PIL", "scipy", "torch"}


def test_the_library_imports_no_study():
    folder = Path(skate_env.__file__).parent
    files = [file.relative_to(folder.parent) for file in folder.rglob("*.py")]
    modules = [
        ".".join(file.with_suffix("").parts) for file in files if "studies" not in file.parts
    ]
    code = f"""
import importlib, sys
for name in {sorted(set(modules) - {"skate_env.__main__"})}:
    try:
        importlib.import_module(name)
    except ModuleNotFoundError as missing:
        assert missing.name.partition(".")[0] in {EXTRAS!r}, missing
assert not [name for name in sys.modules if name.startswith("skate_env.studies")]
"""
    subprocess.run([sys.executable, "-c", code], check=True)


def test_pictures_do_not_depend_on_the_settings_of_matplotlib_and_the_locale(tmp_path):
    """Neither a backend that is not installed, a style of the user's nor ASCII changes them."""
    pictures = []
    for name, settings in (("own", ""), ("users", "text.usetex: True\nlines.linewidth: 9\n")):
        (tmp_path / name).mkdir()
        (tmp_path / name / "matplotlibrc").write_text(settings)
        command = line("replay", "--steps", 1, "--out", "out")
        users = {"MPLBACKEND": "module://none", "LC_ALL": "C", "PYTHONCOERCECLOCALE": "0"}
        env = os.environ | (users | {"PYTHONUTF8": "0"} if settings else {})
        subprocess.run(command, cwd=tmp_path / name, check=True, env=env, stdout=subprocess.DEVNULL)
        pictures.append({p.name: p.read_bytes() for p in (tmp_path / name / "out").glob("*.png")})
    assert pictures[0] == pictures[1] and pictures[0]
