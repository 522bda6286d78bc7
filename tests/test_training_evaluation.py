"""Evaluation: equal starts for all, figures of the simulator, valid confidence intervals."""

import json

import gymnasium
import numpy as np
import pytest
from scipy.stats import trim_mean
from typer.testing import CliRunner

from skate_env.cli import app
from skate_env.learning import FIRST_EVALUATION_SEED
from skate_env.learning.rollouts import UNITS, Conditions, run
from skate_env.learning.statistics import interquartile_mean
from skate_env.policies import baseline, shipped

DISTURBED = {"perturb": 0.02}


def test_figures_are_those_of_the_environment_one_by_one():
    conditions = Conditions(episodes=3, disturbances=DISTURBED, longest=1.5)
    controller = baseline.no_residual("push_only")
    figures = run(controller, {"scene": controller.scene}, conditions)
    assert set(figures) == set(UNITS)
    for i in range(3):
        keywords = DISTURBED | {"scene": "push_only", "action_period": 0.01}
        env = gymnasium.make("IceSkate-v0", accuracy="balanced", **keywords)
        _, info = env.reset(seed=FIRST_EVALUATION_SEED + i)
        terminated, slid, slides = False, 0.0, {"right": 0.0, "left": 0.0}
        while not terminated and info["time"] < 1.5:
            _, _, terminated, _, info = env.step(np.zeros(10, np.float32))
            slides[info["support_leg"]] += info["loaded_slide"] - slid
            slid = info["loaded_slide"]
        sim = env.unwrapped.simulator
        assert figures["time"][i] == sim.time == info["time"]
        assert figures["steps"][i] == info["steps"]
        assert figures["flight"][i] == info["flight_time"] / info["time"]
        assert figures["fell"][i] == terminated
        if info["steps"]:
            slide = sim.totals()["loaded_slide"]
            assert figures["loaded_slide"][i] == slide / info["steps"]
            assert sum(slides.values()) == pytest.approx(slide, abs=1e-12)
            assert figures["weaker_leg_slide"][i] == 2.0 * min(slides.values()) / info["steps"]


def test_an_episode_is_complete_after_its_steps():
    conditions = Conditions(episodes=2, steps=3)
    controller = baseline.no_residual("paper_printed")
    figures = run(controller, {"scene": controller.scene}, conditions)
    np.testing.assert_array_equal(figures["steps"], 3)
    np.testing.assert_array_equal(figures["completed"], 1)
    np.testing.assert_array_equal(figures["fell"], 0)
    # Without disturbance nothing is random.
    for values in figures.values():
        assert values[0] == values[1]


def test_the_interquartile_mean_is_that_of_the_middle_half():
    rng = np.random.default_rng(0)
    scores = rng.normal(size=(5, 40))
    estimate = interquartile_mean(scores)
    middle = np.sort(scores.ravel())[50:150]
    assert estimate.mean == pytest.approx(middle.mean(), abs=1e-12)
    assert estimate.low < estimate.mean < estimate.high
    # The size of an outlier does not matter, only its rank.
    scores[scores.argmax() // 40, scores.argmax() % 40] = 1e9
    assert interquartile_mean(scores).mean == pytest.approx(middle.mean(), abs=1e-12)
    assert interquartile_mean(np.full((5, 8), 3.0)) == interquartile_mean(np.full((1, 8), 3.0))


def test_confidence_intervals_have_their_coverage():
    # The true value is inside in most of many studies; 95 % holds for large studies.
    rng = np.random.default_rng(1)
    inside = 0
    for study in range(100):
        estimate = interquartile_mean(rng.normal(size=(5, 16)), seed=study)
        inside += estimate.low <= 0.0 <= estimate.high
    assert inside >= 85  # 93


def test_missing_values_do_not_count():
    scores = np.array([[1.0, np.nan, 3.0], [1.0, 2.0, 3.0]])
    assert interquartile_mean(scores).mean == trim_mean([1.0, 3.0, 1.0, 3.0], 0.25)
    assert np.isnan(interquartile_mean(np.full((2, 3), np.nan)).mean)


def test_the_command_refuses_invalid_policies(tmp_path):
    result = CliRunner().invoke(
        app, ["evaluate", "--policy", "mine=nowhere/*.npz", "--out", str(tmp_path)]
    )
    assert result.exit_code == 2 and "nowhere" in result.output


def test_the_command_writes_every_episode(tmp_path, random_policy):
    path = tmp_path / "policy.npz"
    random_policy("push_only").save(path)
    arguments = ["--scene", "push_only", "--policy", f"mine={path}", "--episodes", "2"]
    result = CliRunner().invoke(app, ["evaluate", *arguments, "--out", str(tmp_path)])
    assert result.exit_code == 0, result.output
    told = json.loads((tmp_path / "evaluation.json").read_text(encoding="utf-8"))
    assert set(told["episodes"]) == {"baseline", "lifting only", "mine", "mine, with noise"}
    assert np.shape(told["episodes"]["mine"]["steps"]) == (1, 2)
    page = (tmp_path / "evaluation.md").read_text(encoding="utf-8")
    assert "| baseline |" in page
    # Shares have Wilson's interval: 2 of 2.
    assert "100.0 % (34.2 to 100.0)" in page


@pytest.mark.parametrize(
    ("names", "word"),
    [
        (["baseline"], "policy 'baseline'"),
        (["lifting only"], "policy 'lifting only'"),
        (["a", "a"], "'a' is repeated"),
        (["a", "a, with noise"], "policy 'a, with noise'"),
        ([""], "name must be"),
        (["a|b"], "name must be"),
        (["a\nb"], "name must be"),
    ],
)
def test_names_of_policies_differ_and_fit_into_a_table(names, word, tmp_path):
    options = [f"--policy={name}={shipped('push_only')}" for name in names]
    arguments = ["evaluate", *options, "--out", str(tmp_path), "--episodes", "1", "--steps", "1"]
    result = CliRunner().invoke(app, arguments)
    assert result.exit_code == 2 and word in result.output, result.output
    assert not list(tmp_path.iterdir())


def test_an_evaluation_has_every_accuracy(tmp_path):
    for accuracy, status in (("1e-3", 0), ("nonsense", 2)):
        sizes = ["--episodes", "1", "--steps", "1", "--accuracy", accuracy]
        result = CliRunner().invoke(app, ["evaluate", *sizes, "--out", str(tmp_path)])
        assert result.exit_code == status, result.output
