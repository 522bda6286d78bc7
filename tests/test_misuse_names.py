"""Names from strangers: no formula in a picture, folder in a file's name, or control character."""

import os
import shutil

import pytest

from skate_env import Scene, load_scene
from skate_env.policies import shipped
from skate_env.scenes import replace
from tests.commands import invoke

# Matplotlib takes it for a formula, which it cannot parse.
FORMULA = "a|b $_{$ .. c"


@pytest.fixture(scope="module")
def file(tmp_path_factory):
    path = tmp_path_factory.mktemp("scene") / "scene.toml"
    path.write_text(replace("paper", {"name": FORMULA}).to_toml(), encoding="utf-8")
    return path


def run(*arguments):
    done = invoke(*arguments)
    assert done.exit_code == 0, (done.output, done.exception)


def test_a_gait_has_any_name(file, tmp_path):
    run("gait", "--scene", file, "--steps", 2, "--out", tmp_path)
    assert {path.name for path in tmp_path.iterdir()} == {"gaits.json", "gait_a_b______.._c.png"}


def test_a_card_has_any_name(file, tmp_path):
    run("gaits", "--scene", file, "--steps", 2, "--out", tmp_path)
    assert {path.name for path in tmp_path.iterdir()} == {"gaits.md", "gait_a_b______.._c.png"}
    tables = [x for x in (tmp_path / "gaits.md").read_text().splitlines() if x.startswith("|")]
    # The head of the first table, its columns, and its first row.
    assert len({line.replace("\\|", "").count("|") for line in tables[:3]}) == 1


def test_a_comparison_has_any_name(file, tmp_path):
    policy = shipped("paper")
    run("replay", "--scene", file, "--policy", policy, "--steps", 1, "--out", tmp_path)
    assert (tmp_path / "policy_and_baseline.png").exists()


@pytest.mark.long("closes an orbit")
def test_an_orbit_has_any_name(file, tmp_path):
    run("orbit", "--scene", file, "--out", tmp_path)
    assert (tmp_path / "orbit.png").exists()


def test_a_path_that_is_no_text(tmp_path):
    folder = tmp_path / os.fsdecode(b"\xff")
    folder.mkdir()
    scene, policy = folder / "a.toml", folder / os.fsdecode(b"\xff.npz")
    scene.write_text(load_scene("paper").to_toml())
    shutil.copy(shipped("paper"), policy)
    shown = ("--scene", scene, "--policy", policy)
    run("gait", *shown, "--steps", 2, "--json", "--out", folder / "gait")
    run("replay", *shown, "--steps", 1, "--out", folder / "replay")
    film = folder / os.fsdecode(b"\xff.gif")
    run("record", *shown, "--compare-baseline", "--steps", 1, "--size", "644x300", "--out", film)
    assert film.exists() and len(list(folder.glob("*/*.png"))) > 2


# A title, a cleared screen, a line written over, right-to-left text.
CONTROL = "\x1b]0;owned\x07\x1b[2J\r\u202e"


@pytest.mark.parametrize("table", ["", "ice", "start.q"])
def test_no_control_character_of_a_file_reaches_the_terminal(table, tmp_path):
    escaped = "".join(f"\\u{ord(c):04x}" for c in CONTROL)
    path = tmp_path / "scene.toml"
    path.write_text(f'[{table}]\n"{escaped}" = 1\n' if table else f'"{escaped}" = 1\n')
    done = invoke("replay", "--scene", path, "--out", tmp_path / "out")
    assert done.exit_code == 2
    assert "owned" in done.output and done.output.replace("\n", "").isprintable()
    with pytest.raises(ValueError) as refused:
        Scene.from_toml(path.read_text())
    assert str(refused.value).replace("\n", "").isprintable()
