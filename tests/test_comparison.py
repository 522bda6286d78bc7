"""Comparison of a policy with the baseline: the picture of a replay, and films of both."""

import json

import numpy as np
import pytest
from matplotlib import colors
from PIL import Image
from typer.testing import CliRunner

from skate_env import Simulator, load_scene
from skate_env.cli import app
from skate_env.policies import loading
from skate_env.render import Renderer, SideBySide
from skate_env.replay import Recording, comparison, record
from skate_env.replay.film_rollout import FilmRollout

# Both fall: the baseline after 6.0 s, the policy earlier.
SCENE, STEPS = "push_only", 30
SIDES = ("left", "right")


@pytest.fixture(scope="module")
def learned(random_policy):
    return random_policy(SCENE, size=0.1)


@pytest.fixture(scope="module")
def file(learned, tmp_path_factory):
    path = tmp_path_factory.mktemp("policy") / "learned.npz"
    learned.save(path)
    return path


@pytest.fixture(scope="module")
def walks(learned):
    """Return recordings with the policy and of the baseline."""
    scene = learned.scene
    return record(Simulator(scene), STEPS, policy=learned), record(Simulator(scene), STEPS)


def run(*arguments):
    return CliRunner().invoke(app, [str(argument) for argument in arguments])


# --- the picture ---------------------------------------------------------------------------------


def test_axes_have_units_and_both_falls_are_marked(walks):
    figure = comparison.policy_and_baseline(*walks)
    figure.draw_without_rendering()
    labels = [ax.get_ylabel() for ax in figure.axes if ax.get_ylabel()]
    assert labels == [
        "baseline\ncontact state",
        "policy\ncontact state",
        "hip displacement [m]",
        "top of the head [m]",
    ]
    assert [ax.get_xlabel() for ax in figure.axes].count("time [s]") == 2
    said = " ".join(text.get_text() for text in figure.axes[-2].get_legend().get_texts())
    for name, walk in zip(("policy", "baseline"), walks, strict=True):
        assert walk.metadata["termination"] == "fall"
        assert f"{name}, fall at {walk.t[-1]:.2f} s" in said


def test_curves_and_timelines_are_those_of_the_recordings(walks):
    figure = comparison.policy_and_baseline(*walks)
    *_, baseline_states, policy_states, way, head = figure.axes
    for name, walk, states in (
        ("policy", walks[0], policy_states),
        ("baseline", walks[1], baseline_states),
    ):
        lines = {
            line.get_label().split(",")[0]: line.get_xydata() for line in (way.lines + head.lines)
        }
        np.testing.assert_array_equal(lines[name], np.column_stack([walk.t, walk.head[:, 2]]))
        (runs,) = states.collections
        shown, colours = runs.get_segments(), runs.get_colors()
        assert shown[0][0][0] == 0.0 and shown[-1][1][0] == walk.t[-1]
        # Values shown at the samples are the sampled values.
        begins = np.array([run[0][0] for run in shown])
        for i in range(0, len(walk.t) - 1, 7):
            # A new residual may end a contact exactly at a sample.
            sides = [np.searchsorted(begins, walk.t[i], side=side) - 1 for side in SIDES]
            leg = "#cc79a7" if walk.right_support[i] else "#009e73"
            seen = {(shown[at][0][1], colors.to_hex(colours[at])) for at in sides}
            assert (walk.state_number[i], leg) in seen


def test_a_run_without_a_fall_is_drawn_too(random_policy):
    calm = random_policy("paper_printed", size=0.001)
    walk = record(Simulator("paper_printed"), 2, policy=calm)
    figure = comparison.policy_and_baseline(walk, record(Simulator("paper_printed"), 2))
    figure.draw_without_rendering()
    texts = [text.get_text() for text in figure.axes[-2].get_legend().get_texts()]
    assert f"policy, 2 steps at {walk.t[-1]:.2f} s" in texts


def test_replay_names_the_policy_and_draws_both(file, learned, walks, tmp_path):
    done = run("replay", "--policy", file, "--steps", STEPS, "--json", "--out", tmp_path)
    assert done.exit_code == 0, done.output
    drawn = {"fig07_slide_distance.png", "fig08_step_period.png", "policy_and_baseline.png"}
    assert {path.name for path in tmp_path.iterdir()} == drawn | {"steps.csv", "recording.npz"}
    lines = done.stdout.splitlines()
    assert lines[0].split() == ["policy", "learned.npz"]
    assert f"ended by fall after {walks[1].t[-1]:.2f} s" in lines[1]
    summary = json.loads(lines[-1])
    assert summary["policy"] == "learned.npz" and summary["scene"] == SCENE
    assert summary["baseline"]["duration"] == walks[1].t[-1]
    recording = Recording.load(tmp_path / "recording.npz")
    np.testing.assert_array_equal(recording.q, walks[0].q)
    assert recording.metadata["policy"] == learned.about


def test_an_explicit_scene_goes_before_the_policys_own(file, tmp_path):
    said = {}
    for scene in ([], ["--scene", "paper_printed"], ["--set", "ice.friction.mu_forward=0.3"]):
        arguments = ["--no-figures", "--json", "--steps", 1, "--out", tmp_path, *scene]
        done = run("replay", "--policy", file, *arguments)
        assert done.exit_code == 0, done.output
        said[" ".join(scene)] = json.loads(done.stdout.splitlines()[-1])
    assert said[""]["scene"] == SCENE and said["--scene paper_printed"]["scene"] == "paper_printed"
    assert len({one["slide_per_step"][0] for one in said.values()}) == 3


def test_the_shipped_policy_of_a_scene(learned, tmp_path, monkeypatch):
    shipped = tmp_path / "shipped"
    shipped.mkdir()
    learned.save(shipped / f"{SCENE}.npz")
    monkeypatch.setattr(loading, "_FOLDER", shipped)
    out = tmp_path / "out"
    base = ["replay", "--policy", "shipped", "--steps", 1, "--no-figures", "--out", out]
    done = run(*base, "--scene", SCENE)
    assert done.exit_code == 0 and "the shipped one of push_only" in done.stdout
    # The default scene is paper.
    for more in ([], ["--scene", "paper_printed"]):
        done = run(*base, *more)
        assert done.exit_code == 2 and "there is one for push_only" in done.stderr


@pytest.mark.parametrize("command", ["replay", "record"])
def test_invalid_policies_are_refused_in_one_line(command, file, tmp_path):
    text = tmp_path / "text.npz"
    text.write_text("policy")
    scene = tmp_path / "scene.toml"
    scene.write_text(load_scene("push_only").without("arms").to_toml())
    out = tmp_path / ("out" if command == "replay" else "film.gif")
    for arguments, said in (
        (["--policy", text], "text.npz: not an .npz file"),
        (["--policy", tmp_path / "none.npz"], "No such file"),
        (["--policy", file, "--scene", scene], "joint_names[9] is 'q11'"),
        (["--policy", file, "--scene", "nope"], "no scene 'nope'"),
    ):
        done = run(command, *arguments, "--steps", 1, "--out", out)
        assert done.exit_code == 2, done.output
        last = done.stderr.strip().splitlines()[-1]
        assert last.startswith("error: ") and said in last and "Traceback" not in done.output
        assert not out.exists()


# --- films ---------------------------------------------------------------------------------------


@pytest.mark.parametrize("with_policy", [False, True])
def test_the_residual_is_constant_between_actions(with_policy, learned):
    acting = learned if with_policy else None
    rollout, sim = FilmRollout(Simulator(SCENE), acting), Simulator(SCENE)
    for _ in range(40):
        residual = learned.residual(sim) if with_policy else None
        middle = Simulator(SCENE)
        middle.restore(sim.snapshot())
        middle.advance(sim.time + 0.004, residual)
        np.testing.assert_array_equal(rollout.advance(sim.time + 0.004).q, middle.q)
        sim.step(residual)
        np.testing.assert_array_equal(rollout.advance(sim.time).q, sim.q)


def test_a_film_shows_the_policy(file, learned, tmp_path):
    out = tmp_path / "film.gif"
    arguments = ["--steps", STEPS, "--fps", 5, "--size", "320x200", "--out", out]
    done = run("record", "--policy", file, *arguments)
    assert done.exit_code == 0, done.output
    assert done.stdout.split()[:2] == ["policy", "learned.npz"]
    sim = Simulator(SCENE)
    for _ in range(60):
        sim.step(learned.residual(sim))
    with Image.open(out) as image:
        image.seek(3)
        shown = np.asarray(image.convert("RGB")).astype(int)
    wanted = Renderer(320, 200).draw(sim).astype(int)
    # A GIF has 256 colours.
    assert np.abs(shown - wanted).mean() < 2.0


def test_a_picture_of_two_has_the_pictures_of_each(learned):
    sims = [Simulator(SCENE), Simulator(SCENE)]
    for _ in range(30):
        sims[0].step()
        sims[1].step(learned.residual(sims[1]))
    stage = SideBySide(960, 540, ("baseline", "policy"))
    picture = stage.draw(sims)
    assert picture.shape == (540, 960, 3)
    half = Renderer(478, 497)
    np.testing.assert_array_equal(picture[43:, :478], half.draw(sims[0]))
    np.testing.assert_array_equal(picture[43:, -478:], half.draw(sims[1]))
    # The bar shows two different names.
    assert not np.array_equal(picture[:43, :478], picture[:43, -478:])


def test_a_fallen_robot_is_grey_while_the_other_continues():
    fallen, skating = Simulator(SCENE), Simulator("paper_printed")
    while fallen.step():
        pass
    stage = SideBySide(700, 300, ("a", "b"))
    first, second = stage.draw([fallen, skating]), stage.draw([fallen, skating])
    np.testing.assert_array_equal(first, second)
    bar, half = 24, 348
    left, right = first[bar:, :half].astype(int), first[bar:, -half:].astype(int)
    assert np.ptp(left, axis=2).max() == 0 < np.ptp(right, axis=2).max()
    skating.step()
    np.testing.assert_array_equal(stage.draw([fallen, skating])[:, :half], first[:, :half])


def test_a_film_of_two_ends_with_the_later_end(file, walks, tmp_path):
    out = tmp_path / "film.gif"
    arguments = ["--steps", STEPS, "--fps", 5, "--size", "644x240", "--out", out]
    done = run("record", "--policy", file, "--compare-baseline", *arguments)
    assert done.exit_code == 0, done.output
    ends = [walk.t[-1] for walk in walks]
    assert f"filmed              {len(walks[0].steps)} steps, {ends[0]:.2f} s" in done.stdout
    assert f"baseline            {len(walks[1].steps)} steps, {ends[1]:.2f} s" in done.stdout
    with Image.open(out) as image:
        assert image.size == (644, 240)
        assert image.n_frames == int(np.ceil(max(ends) * 5)) + 1


def test_invalid_films_of_two_are_refused(file, tmp_path):
    for arguments, said in (
        (["--compare-baseline"], "name a policy with --policy"),
        (["--compare-baseline", "--policy", file, "--size", "640x400"], "644x217"),
    ):
        done = run("record", *arguments, "--out", tmp_path / "film.gif")
        assert done.exit_code == 2 and said in done.stderr
        assert not any(tmp_path.iterdir())
