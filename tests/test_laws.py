"""Laws of mechanics in Python, and the campaign that looks for motions that break them."""

import json
import pickle

import gymnasium
import numpy as np
import pytest

import skate_env
from skate_env.scenes import replace
from tests.campaigns import laws
from tests.commands import invoke


def broken(sim):
    return {law["law"] for law in sim.laws() if law["count"]}


def test_a_simulator_tells_how_it_has_kept_each_law():
    sim = skate_env.Simulator("push_only")
    assert sim.laws() == []
    sim.check_laws()
    sim.advance(0.5)
    found = {law["law"]: law for law in sim.laws()}
    assert len(found) == 14 and not broken(sim)
    rates = found["finite_rates"]
    assert (rates["unit"], rates["limit"], rates["breaches"]) == ("rad/s", 1e3, [])
    assert 1.0 < rates["largest"] < 1e3
    # Resets, perturbations and kicks are no part of the motion; what was found stays.
    sim.reset()
    sim.perturb(0.01, 3)
    sim.advance(0.2)
    sim.kick(0.3)
    sim.advance(0.4)
    assert not broken(sim) and sim.laws()[-1]["largest"] >= rates["largest"]
    assert pickle.loads(pickle.dumps(sim)).laws() == []
    sim.check_laws(False)
    assert sim.laws() == []


@pytest.mark.long("the energy balance of 450 s of random play")
def test_no_energy_is_lost_where_feet_stop():
    """Feet stop at the same instant, one of them wedged, and none loses energy."""
    accuracy = {"method": "dop853", "tolerance": 1e-9}
    scene = replace(skate_env.load_scene("paper"), {"accuracy": accuracy})
    for seed in range(250):
        sim, rng = skate_env.Simulator(scene), np.random.default_rng(seed)
        sim.perturb(0.02, seed)
        sim.check_laws()
        for _ in range(180):
            # 1.6 mJ, of at most 11 uJ, were lost.
            sim.step(rng.choice([-100.0, 100.0], 16) * (np.arange(16) < 9))
        assert not broken(sim), seed


@pytest.mark.parametrize(("kind", "seed"), [("zero", 12), ("zero", 27), ("uniform", 93)])
def test_dense_output_is_accurate_where_a_step_ends_early(kind, seed):
    """At guards and controller samples; its error broke laws by 0.48 J, 0.26 m, 0.95 J."""
    found = laws.play(laws.Case("IceSkateAnyIce-v0", laws.OWN, "balanced", kind), seed)
    assert not found.broken, found.largest


def test_a_breach_has_time_amount_state_and_event():
    """A joint without limit turns faster than 1,000 rad/s."""
    sim = skate_env.Simulator(replace(skate_env.load_scene("push_only"), {"accuracy": "balanced"}))
    sim.check_laws()
    torque = np.zeros(16)
    torque[9:] = 1e5
    sim.step(torque)
    (rates,) = (law for law in sim.laws() if law["law"] == "finite_rates")
    first = rates["breaches"][0]
    assert rates["count"] >= 1 and rates["largest"] >= first["amount"] > 1e3
    assert 0.0 < first["time"] <= 0.01 and first["event"] is None
    assert "/" in first["state"] and len(rates["breaches"]) <= 8


@pytest.mark.parametrize("accuracy", ["balanced", "fast"])
def test_environments_are_checked_and_their_motions_keep_their_bits(accuracy):
    name = "skate_env:IceSkate-v0"
    plain, checked = (gymnasium.make_vec(name, num_envs=3, accuracy=accuracy) for _ in range(2))
    checked.unwrapped.check_laws()
    for envs in (plain, checked):
        envs.reset(seed=1)
        envs.action_space.seed(1)
        for _ in range(20):
            envs.step(envs.action_space.sample())
    assert plain.unwrapped.snapshot() == checked.unwrapped.snapshot()
    assert plain.unwrapped.simulator(0).laws() == []
    assert len(checked.unwrapped.simulator(2).laws()) == 14
    env = gymnasium.make("skate_env:IceSkate-v0").unwrapped
    env.check_laws()
    env.reset(seed=1)
    env.step(np.zeros(10))
    assert len(env.simulator.laws()) == 14


@pytest.mark.parametrize(("successes", "trials"), [(13, 134), (1, 32), (0, 10), (10, 10)])
def test_intervals_are_those_of_wilson(successes, trials):
    """Ends are the shares p of which the one found is 1.96 standard deviations away."""
    share = successes / trials
    low, high = laws.wilson(successes, trials)
    assert low <= share <= high
    for p in {low, high} - {share}:
        deviation = np.sqrt(p * (1.0 - p) / trials)
        assert abs(share - p) / deviation == pytest.approx(1.959963984540054, rel=1e-9)


@pytest.fixture
def short(monkeypatch):
    monkeypatch.setattr(laws, "EPISODES", 2)
    monkeypatch.setattr(laws, "EPISODE", 0.5)


def test_a_campaign_goes_on_where_it_was_stopped(short, tmp_path, monkeypatch):
    case = laws.Case("IceSkatePushOnly-v0", laws.OWN, "balanced", "uniform")
    whole = laws.run(case, 100, tmp_path / "whole")
    laws.run(case, 50, tmp_path / "parts")
    played = []
    monkeypatch.setattr(
        laws, "play", lambda case, seed, play=laws.play: played.append(seed) or play(case, seed)
    )
    assert laws.run(case, 100, tmp_path / "parts") == whole
    assert played and 0 not in played
    assert whole.ends.total() == 2 * len(list((tmp_path / "whole" / case.name).iterdir()))


@pytest.mark.parametrize("kind", laws.KINDS)
@pytest.mark.parametrize("name", laws.IDS)
def test_every_environment_plays_every_kind_of_actions(short, name, kind):
    case = laws.Case(name, laws.OWN, "fast", kind)
    counts = laws.play(case, 0)
    assert counts.ends.total() == 2 and 0.0 < counts.time <= 1.01
    assert laws.play(case, 0) == counts


def test_a_scene_without_a_policy_has_no_case_with_it(short):
    assert laws.play(laws.Case("IceSkate-v0", "paper_arms", "fast", "policy"), 0) is None


def test_command_writes_tables(short, tmp_path):
    done = invoke(
        "laws",
        "--id",
        "IceSkate-v0",
        "--kind",
        "zero",
        "--kind",
        "extreme",
        "--accuracy",
        "fast",
        "--actions",
        1,
        "--out",
        tmp_path,
    )
    assert done.exit_code == 0, done.output
    text = (tmp_path / "laws.md").read_text()
    assert text in done.output and "| time_limit | 2 (34.2 to 100.0 %) |" in text
    results = json.loads((tmp_path / "laws.json").read_text())
    # Two episodes of 0.5 s, in actions of 20 ms.
    assert [each["actions"] for each in results] == [50, 50]
    assert results[0]["id"] == "IceSkate-v0" and results[0]["ends"] == {"time_limit": 2}


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (("--id", "Ice"), "--id Ice: must be one of IceSkate-v0"),
        (("--kind", "none"), "--kind none: must be one of uniform"),
        (("--scene", "nowhere"), "nowhere"),
        (("--accuracy", "sloppy"), "accuracy: must be fast"),
        (("--actions", 0), "--actions"),
        (("--out", "/dev/null/x"), "/dev/null"),
    ],
)
def test_invalid_options_are_refused_clearly(arguments, says, tmp_path):
    done = invoke("laws", "--out", tmp_path, *arguments)
    assert done.exit_code == 2
    assert says in done.output and "Traceback" not in done.output
