"""Presets, changed copies of them, and random starts."""

import json

import numpy as np
import pytest

import skate_env
from skate_env import Policy, Simulator, load_scene, scene_names
from skate_env.environments import joints
from skate_env.policies import shipped
from skate_env.replay import TAU8, record
from skate_env.replay.figures import shoulder_angles
from skate_env.replay.replays import Start, simulate
from skate_env.scenes import replace
from skate_env.studies.fixtures import BLADE, PAPER_DAMPED
from training.gaits import robustness

SUPPORT = ("y0", "z0", "q1")
# Of the share of 256 perturbed starts. Measured: `paper` 96.1 % (93.0 to 97.9), `paper_arms` 99.2 %
# (97.2 to 99.8), `paper_damped` 100 % (98.5 to 100); of 20 starts of `blade` 95 % (76 to 99).
LEAST = {"paper": 0.9, "paper_arms": 0.95, PAPER_DAMPED: 0.95, BLADE: 0.7}
LEGS = ("q2", "q3", "q4", "q5", "q6", "q7")


@pytest.mark.parametrize("name", scene_names())
def test_preset_has_its_file_name_a_provenance_and_a_start(name):
    scene = load_scene(name)
    fields = json.loads(scene.to_json())
    assert scene.name == name
    assert fields["description"] and fields["provenance"]
    assert Simulator(scene).termination is None


@pytest.mark.parametrize("name", scene_names())
def test_preset_survives_both_formats(name):
    scene = load_scene(name)
    assert type(scene).from_toml(scene.to_toml()).to_json() == scene.to_json()
    assert type(scene).from_json(scene.to_json()).to_toml() == scene.to_toml()


def test_equal_scenes_have_equal_hashes(paper):
    plus, minus = (replace("paper", {"start.q": {"q2": zero}}) for zero in (0.0, -0.0))
    assert plus == minus and hash(plus) == hash(minus)
    assert hash(plus) != hash(replace(plus, {"start.q": {"q2": 1e-3}}))


@pytest.mark.parametrize("name", ["paper", "paper_arms", PAPER_DAMPED, BLADE])
def test_preset_makes_100_steps(name):
    scene = load_scene(name)
    if name == BLADE:
        # It amplifies differences 1e11 times within 7 s; at `balanced` rounding decides on a fall.
        scene = replace(scene, {"accuracy": "reference"})
    assert record(Simulator(scene), 100).metadata["termination"] is None


@pytest.mark.long("the share of 256 perturbed starts that docs/scenes.md states")
@pytest.mark.parametrize("name", ["paper", "paper_arms", PAPER_DAMPED, BLADE])
def test_most_disturbed_starts_make_100_steps_too(name):
    """By the lower end of Wilson's interval of 95 %."""
    runs = robustness.measure(load_scene(name), 100, lambda _: None)
    assert runs.at_least > LEAST[name]


@pytest.mark.parametrize("name", ["push_only", BLADE])
def test_push_only_contact_never_pulls(name):
    sim = Simulator(replace(load_scene(name), {"control.action_period": 1e-3}))
    mu_forward, mu_backward, smallest = 0.2, 0.9, 1e-9
    for _ in range(10_000):
        if not sim.step():
            break
        # Heel and toe are compressive, so the centre of pressure is between them. Measured: 0 N.
        f_y, loads = sim.contact_forces[:, 0], sim.contact_forces[:, 1:]
        normal = loads.sum(axis=1)
        assert loads.min() >= -smallest
        assert np.all(f_y <= mu_backward * normal + smallest)
        assert np.all(f_y >= -mu_forward * normal - smallest)
        # Both ends of both soles. Measured: 1e-11 m.
        assert sim.link_segments()[[0, 6], :, 2].min() > -1e-9
    steps = sim.take_steps()
    assert steps and sum(step["inadmissible_time"] for step in steps) == 0.0


@pytest.mark.parametrize(("name", "opposed"), [(PAPER_DAMPED, -0.5), ("paper_arms", -0.7)])
def test_tau8_opposes_the_arms_and_widens_their_swing(name, opposed):
    scene = load_scene(name)
    runs = [record(Simulator(each), 100) for each in (scene, replace(scene, TAU8))]
    without, with_tau8 = (shoulder_angles(run)[run.t.size // 2 :] for run in runs)
    assert np.corrcoef(without.T)[0, 1] > 0.99
    # Measured -0.58 and -0.74.
    assert np.corrcoef(with_tau8.T)[0, 1] < opposed
    # Measured 0.39 to 0.76 rad and 0.32 to 0.81 rad.
    assert np.ptp(with_tau8, axis=0).min() > 1.5 * np.ptp(without, axis=0).max()


def test_file_gives_the_same_scene_as_its_name(tmp_path):
    path = tmp_path / "mine.toml"
    path.write_text(load_scene("paper").to_toml(), encoding="utf-8")
    assert load_scene(path).to_json() == load_scene("paper").to_json()
    assert load_scene(str(path)).to_json() == load_scene("paper").to_json()


def test_an_unknown_scene_lists_the_known_ones():
    with pytest.raises(ValueError) as refusal:
        load_scene("papier")
    assert all(name in str(refusal.value) for name in [*scene_names(), "papier"])


def test_bad_file_is_named(tmp_path):
    path = tmp_path / "bad.toml"
    path.write_text("ice = 3", encoding="utf-8")
    with pytest.raises(ValueError, match="bad"):
        load_scene(path)


def test_replace_changes_that_field_alone_and_not_the_original():
    scene = load_scene("paper")
    before = scene.to_json()
    expected = json.loads(before)
    expected["ice"]["friction"]["mu_forward"] = 0.3
    expected["start"]["support_leg"] = "left"
    changed = replace(scene, {"ice.friction.mu_forward": 0.3, "start.support_leg": "left"})
    assert json.loads(changed.to_json()) == expected
    assert scene.to_json() == before


def test_replace_switches_an_effect_on_and_off():
    scene = load_scene("paper")
    on = replace(scene, {"control.arm_swing.amplitude": 12.0})
    assert on.get("control.arm_swing") == {"amplitude": 12.0}
    off = replace(on, {"control.arm_swing": None})
    assert off.get("control.arm_swing") is None


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"ice.mu": 0.3}, ["gravity", "friction"]),
        ({"ice.friction.mu": 0.3}, ["mu_forward", "mu_backward"]),
        ({"ise.mu_forward": 0.3}, ["ise", "contact"]),
        ({"ice.friction.mu_forward": -1.0}, ["ice.friction.mu_forward"]),
        ({"ice.friction.mu_forward": "slippery"}, ["ice.friction.mu_forward", "slippery"]),
        ({"name.first": "x"}, ["name"]),
        ({"": 1}, ["contact"]),
    ],
)
def test_replace_refuses_invalid_values_with_the_valid_ones(change, said):
    with pytest.raises(ValueError) as refusal:
        replace(load_scene("paper"), change)
    assert all(word in str(refusal.value) for word in said), refusal.value


def _start(sigma: float, seed: int) -> dict[str, np.ndarray]:
    sim = Simulator("paper")
    sim.perturb(sigma, seed)
    return {"q": sim.q, "v": sim.v}


def test_perturbed_start_depends_on_the_seed_alone():
    first, again, other = _start(0.01, 4), _start(0.01, 4), _start(0.01, 5)
    assert all(np.array_equal(first[key], again[key]) for key in first)
    assert not np.array_equal(first["q"], other["q"])


def test_perturbed_start_moves_legs_and_speed_alone():
    sim = Simulator("paper")
    names = sim.coordinate_names
    perturbed = _start(0.01, 1)
    moved_q = {name for name, d in zip(names, perturbed["q"] - sim.q, strict=True) if d != 0.0}
    moved_v = {name for name, d in zip(names, perturbed["v"] - sim.v, strict=True) if d != 0.0}
    assert moved_q == set(LEGS)
    assert moved_v == {"y0", *LEGS}


def test_perturbed_start_has_the_size_asked_for():
    sim = Simulator("paper")
    legs = [sim.coordinate_names.index(name) for name in LEGS]
    v0, q0 = sim.v, sim.q
    sigma = 0.01
    starts = [_start(sigma, seed) for seed in range(200)]
    rates = np.array([start["v"] - v0 for start in starts])
    speed = rates[:, 0] / v0[0]
    # 1,200 and 200 draws: within four standard errors.
    assert np.std(rates[:, legs]) == pytest.approx(sigma, rel=0.1)
    assert np.std(speed) == pytest.approx(sigma, rel=0.2)
    # Draws below the ice are rejected, so the distribution of angles may be narrower.
    assert np.std([start["q"][legs] - q0[legs] for start in starts]) < 1.1 * sigma


def test_no_perturbation_is_the_scene_own_start():
    sim = Simulator("paper")
    start = _start(0.0, 7)
    assert np.array_equal(start["q"], sim.q) and np.array_equal(start["v"], sim.v)


@pytest.mark.parametrize("sigma", [-0.1, np.nan, np.inf])
def test_impossible_perturbation_is_refused(sigma):
    with pytest.raises(ValueError, match="perturb"):
        Simulator("paper").perturb(sigma, 0)


def test_functions_of_a_scene_take_its_name_path_or_table(tmp_path):
    path = tmp_path / "paper.toml"
    scene = load_scene("paper")
    path.write_text(scene.to_toml(), encoding="utf-8")
    learned = Policy.load(shipped("paper"))
    for given in ("paper", path, str(path), json.loads(scene.to_json())):
        assert skate_env.Simulator(given).scene == scene
        assert skate_env.IceSkateEnv(given).scene == scene
        assert skate_env.to_mjcf(given) == skate_env.to_mjcf(scene)
        assert replace(given, {}) == replace(scene, {})
        assert joints(given) == joints(scene)
        assert learned.on(given).scene == scene
        assert simulate(given, 1, Start(), "test").scene == scene


def test_a_table_of_fields_that_is_no_scene_is_refused(refused):
    fields = json.loads(load_scene("paper").to_json())
    for wrong, kind, words in (
        ({"iec": 1.0}, ValueError, ["iec"]),
        ({"name": object()}, TypeError, ["name"]),
        ({1: 2.0}, TypeError, ["name must be a str"]),
        ({"ice": {"gravity": float("nan")}}, ValueError, ["ice"]),
    ):
        refused(kind, lambda wrong=wrong: skate_env.IceSkateEnv(fields | wrong), *words)
