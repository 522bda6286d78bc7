"""The examples run, and their output agrees with the laws that they show."""

import os
import re
import subprocess
import sys
from pathlib import Path

import gymnasium
import numpy as np
import pytest

import skate_env
from skate_env._core import REWARD_WEIGHTS
from skate_env.environments import IceSkateVectorEnv
from skate_env.policies import baseline
from skate_env.registration import IDS
from skate_env.scenes import replace

LONGEST = {name: default for name, _, default in REWARD_WEIGHTS}["longest_step"]
EXAMPLES = Path(__file__).parents[1] / "docs" / "examples"
NUMBER = r"(-?\d+\.?\d*)"


def run(name: str, *arguments: str, warns: bool = False) -> str:
    """Run an example in a separate process; it must succeed, without a warning unless `warns`."""
    done = subprocess.run(
        [sys.executable, EXAMPLES / name, *arguments],
        # One thread: more compete with the other tests.
        env=os.environ | {"PYTHONWARNINGS": "error::UserWarning", "OMP_NUM_THREADS": "1"},
        capture_output=True,
        text=True,
        timeout=300,
    )
    assert done.returncode == 0, done.stderr
    assert warns or "Warning" not in done.stderr, done.stderr
    return done.stdout


@pytest.mark.parametrize("path", sorted(EXAMPLES.glob("*.py")), ids=lambda path: path.stem)
def test_examples_are_short_and_say_how_to_run_them(path):
    text = path.read_text(encoding="utf-8")
    assert len(text.splitlines()) <= 45
    assert f"``python docs/examples/{path.name}" in text.split('"""')[1]


def test_replay_slides_as_far_as_the_simulator_says():
    seen = re.findall(
        rf"^(\w[\w ]*?) +{NUMBER} m slid, +(\d+) steps in +{NUMBER} s", run("replay.py"), re.M
    )
    policies = {
        "no residual": baseline.no_residual(),
        "half the feedforward": baseline.scaled_feedforward(factor=0.5),
        "visual lifting only": baseline.lifting_only(),
    }
    assert [name for name, *_ in seen] == list(policies)
    for (name, slide, steps, time), policy in zip(seen, policies.values(), strict=True):
        sim = skate_env.Simulator(replace(policy.scene, {"control.action_period": 0.02}))
        made, since = 0, 0.0
        # An environment also ends an episode without a step for `LONGEST`.
        while sim.time < 10.0 and sim.time - since <= LONGEST and sim.step():
            totals = sim.totals()
            if totals["steps"] > made:
                made, since = totals["steps"], sim.time
        # Printed to 0.01 m and 0.01 s.
        assert float(slide) == pytest.approx(totals["loaded_slide"], abs=0.005 + 1e-9), name
        assert int(steps) == totals["steps"]
        assert float(time) == pytest.approx(sim.time, abs=0.005 + 1e-9)
    # Lifting alone raises the head but makes no steps.
    assert int(seen[0][2]) > 0 and int(seen[2][2]) == 0


def test_forces_of_a_step_carry_the_weight():
    lines = re.findall(rf"^step \d: \((\d+), 2, 4\), mean N {NUMBER} N", run("forces.py"), re.M)
    weight = 9.81 * sum(body["mass"] for body in skate_env.Simulator("paper").bodies())
    assert len(lines) == 5 and all(int(samples) > 20 for samples, _ in lines)
    # Of a periodic motion the mean is the weight, but for the sampling. Measured: 4 % apart.
    assert [float(mean) for _, mean in lines] == pytest.approx([weight] * 5, rel=0.08)


def test_vector_counts_every_episode_once():
    out = run("vector.py")
    episodes = int(re.search(r"^(\d+) episodes:", out, re.M)[1])
    ends = {end: int(n) for n, end in re.findall(r"(\d+) ([a-z_ ]+?)(?:,|$)", out.splitlines()[0])}
    ends.pop("episodes:", None)
    assert set(ends) <= {*skate_env._core.TERMINATIONS, "time limit"}
    # All 64 first episodes reach their time limit within 300 actions unless they fall earlier.
    assert sum(ends.values()) == episodes >= 64
    assert ends["time limit"] > 0 and ends["fall"] > 0
    assert out == run("vector.py"), "threads must not change results"


def test_snapshot_continues_bit_for_bit():
    out = run("snapshot.py")
    returns = re.findall(rf"^action (\d) over 0.2 s: return {NUMBER}", out, re.M)
    assert len(returns) == len({value for _, value in returns}) == 5
    one, other = re.search(rf"from the pickle: {NUMBER}, {NUMBER}$", out, re.M).groups()
    assert one == other
    assert "bit for bit the same: True" in out


def test_randomisation_draws_within_its_ranges_and_by_its_seeds():
    out = run("randomisation.py")
    text = (EXAMPLES / "randomisation.py").read_text(encoding="utf-8")
    ranges = re.findall(rf'^    "([\w.]+)": \[{NUMBER}, {NUMBER}\]', text, re.M)
    assert len(ranges) == 3
    drawn = [re.findall(rf"= {NUMBER}", line) for line in out.splitlines()]
    assert len(drawn) == 6
    for numbers in drawn:
        for number, (_, low, high) in zip(numbers, ranges, strict=True):
            assert float(low) <= float(number) <= float(high)
    first, second, third, again, later, given = drawn
    assert first == again
    assert len({tuple(numbers) for numbers in (first, second, third, later)}) == 4
    # Given parameters override drawn ones and do not change the other drawn ones.
    assert given == ["0.25", *first[1:]]


def test_record_writes_two_films(tmp_path):
    pytest.importorskip("moviepy")
    run("record.py", str(tmp_path / "films"))
    films = sorted((tmp_path / "films").iterdir())
    assert [film.name for film in films] == [f"iceskate-episode-{i}.mp4" for i in (0, 1)]
    ffmpeg = pytest.importorskip("imageio_ffmpeg")
    for film in films:
        frames, seconds = ffmpeg.count_frames_and_secs(str(film))
        # 60 actions of 20 ms, and the start.
        assert frames == 61
        assert seconds == pytest.approx(61 * 0.02, abs=0.02)


def test_sb3_saves_and_evaluates_what_it_has_learned(tmp_path):
    pytest.importorskip("stable_baselines3")
    out = run("sb3.py", "4096", str(tmp_path / "sb3"))
    lines = re.findall(rf"^(\w+): return {NUMBER}, {NUMBER} s an episode$", out, re.M)
    assert [name for name, *_ in lines] == ["baseline", "learned"]
    assert {path.name for path in (tmp_path / "sb3").iterdir()} == {"model.zip", "normaliser.pkl"}
    # The baseline's mean is that of the environment with zero actions.
    envs = IceSkateVectorEnv(8, "push_only", perturb=0.01, autoreset_mode="SameStep")
    envs.reset(seed=1)
    lengths, now = [[] for _ in range(8)], np.zeros(8, int)
    while min(map(len, lengths)) < 2:
        _, _, terminated, truncated, _ = envs.step(np.zeros((8, 10), np.float32))
        now += 1
        for i in np.flatnonzero(terminated | truncated):
            lengths[i].append(now[i])
            now[i] = 0
    mean = np.mean([length[:2] for length in lengths]) / 100
    assert float(lines[0][2]) == pytest.approx(mean, abs=0.005 + 1e-9)


def test_wrappers_of_gymnasium_count_every_episode():
    out = run("wrappers.py")
    found = re.search(rf"^(\d+) episodes: return {NUMBER}, (\d+) actions$", out, re.M)
    episodes, length = int(found[1]), int(found[3])
    # 16 environments, 300 actions each; the reset of an episode takes one; the mean is rounded.
    assert 0 < episodes * (length + 0.5) <= 16 * 300
    assert float(re.search(rf"standard deviation {NUMBER}$", out, re.M)[1]) > 0.5


def test_stable_baselines3_alone_on_the_bare_id(tmp_path):
    pytest.importorskip("stable_baselines3")
    text = (EXAMPLES / "ppo.py").read_text(encoding="utf-8")
    imports = set(re.findall(r"^(?:from|import) (\w+)", text, re.M))
    assert imports == {"sys", "pathlib", "gymnasium", "stable_baselines3", "skate_env"}
    # Only the export after the training is of this package.
    assert re.findall(r"^from skate_env.*$", text, re.M) == ["from skate_env import Policy"]
    training, rest = text.split("model.learn(actions)")
    assert training.count("Policy") == 2 and '"MlpPolicy"' in training and "Policy.from" in rest
    out = run("ppo.py", "IceSkatePushOnly-v0", "1", "8192", str(tmp_path / "ppo"))
    lines = re.findall(rf"^(\d+) steps in {NUMBER} s, return {NUMBER}$", out, re.M)
    assert len(lines) == 8
    files = {path.name for path in (tmp_path / "ppo").iterdir()}
    assert files == {"model.zip", "normaliser.pkl", "policy.npz"}
    # `skate-env replay --policy` plays it: from the same start as the example, to rounding.
    policy = skate_env.Policy.load(tmp_path / "ppo" / "policy.npz")
    env = gymnasium.make("IceSkatePushOnly-v0", **policy.environment())
    observation, over, total = env.reset(seed=1_000_000)[0], False, 0.0
    while not over:
        observation, reward, *ends, info = env.step(policy.predict(observation)[0])
        over, total = any(ends[:2]), total + reward
    assert total == pytest.approx(float(lines[0][2]), abs=0.06)
    assert info["time"] == pytest.approx(float(lines[0][1]), abs=0.006)


def test_the_zoo_has_the_settings_of_the_example():
    yaml = pytest.importorskip("yaml")
    file = EXAMPLES.parents[1] / "training" / "benchmark" / "hyperparameters" / "ppo.yml"
    settings = yaml.safe_load(file.read_text(encoding="utf-8"))
    text = (EXAMPLES / "ppo.py").read_text(encoding="utf-8")
    assert set(settings) == set(IDS)
    for each in settings.values():
        for name in ("n_steps", "batch_size", "n_epochs", "gamma"):
            assert f'"{name}": {each[name]}' in text
        assert f'make_vec_env(f"skate_env:{{name}}", {each["n_envs"]}, seed' in text
        assert each["n_timesteps"] == 1.5e6 and "1_500_000" in text
        assert each["learning_rate"] == "lin_1e-3" and "1e-3 * left" in text
        assert each["policy_kwargs"] == "dict(log_std_init=-0.5)"
        assert '"log_std_init": -0.5' in text


def test_contrib_learns_off_policy():
    pytest.importorskip("sb3_contrib")
    out = run("contrib.py", "800")
    assert re.search(rf"^return {NUMBER}, standard deviation {NUMBER}$", out, re.M)


def test_one_file_of_pytorch():
    pytest.importorskip("torch")
    lines = re.findall(rf"^(\d+) actions: {NUMBER} of reward", run("cleanrl.py", "16384"), re.M)
    assert [int(made) for made, _ in lines] == [8192, 16384]


def test_torchrl_rolls_out():
    pytest.importorskip("torchrl")
    out = run("torchrl_rollout.py")
    assert "observations (1000, 76), actions (1000, 10)" in out
    assert int(re.search(r"^(\d+) episodes", out, re.M)[1]) > 3


def test_rllib_trains():
    pytest.importorskip("ray")
    assert re.search(rf"^\d+ actions: return {NUMBER}$", run("rllib.py", "1", warns=True), re.M)


def test_the_benchmark_has_the_settings_of_the_example():
    pytest.importorskip("torch")
    yaml = pytest.importorskip("yaml")
    from training.benchmark.learners import LEARNERS

    file = EXAMPLES.parents[1] / "training" / "benchmark" / "hyperparameters" / "ppo.yml"
    zoo = yaml.safe_load(file.read_text(encoding="utf-8"))["IceSkate-v0"]
    learner = LEARNERS["example"]
    assert (learner.environments, learner.actions) == (zoo["n_envs"], zoo["n_timesteps"])
    assert learner.normalise is zoo["normalize"]
    assert {"accuracy": learner.accuracy} == zoo["env_kwargs"]
    settings = dict(learner.settings)
    rate, policy = settings.pop("learning_rate"), settings.pop("policy_kwargs")
    assert rate(1.0) == 1e-3 and rate(0.25) == 2.5e-4
    assert policy == {"log_std_init": -0.5}
    assert settings == {name: zoo[name] for name in settings}
