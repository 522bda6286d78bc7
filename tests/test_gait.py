"""Gaits: laws that their quantities obey, and a count of the order by other means."""

import json
import re
from itertools import pairwise

import numpy as np
import pytest
from typer.testing import CliRunner

from skate_env import Simulator, load_scene, scene_names
from skate_env.cli import app
from skate_env.gait import QUANTITIES, StepOrder, contact, skate, step_orders
from skate_env.gait.report import summary, text, values
from skate_env.replay import record
from skate_env.scenes import replace
from skate_env.studies.fixtures import PAPER_DAMPED

# The preset in the order of the paper.
IN_ORDER = "paper"
SCENES = scene_names()
STEPS = 5


@pytest.fixture(scope="module")
def motions():
    """Motions of all presets."""
    return {name: skate(Simulator(load_scene(name)), STEPS) for name in SCENES}


@pytest.fixture(params=SCENES)
def name(request):
    return request.param


@pytest.fixture
def motion(name, motions):
    return motions[name]


def count_independently(scene, steps):
    """Count complete steps, and those in the order, from events and states only.

    Uses nothing of `skate_env.gait.contact_sequence`.
    """
    sim = Simulator(scene)
    # (time, state, leg) from this time on.
    log = [(0.0, sim.state_number, sim.support_leg)]
    swaps = []
    while len(swaps) < steps and sim.step():
        for time, _, _, state, leg in sim.take_events():
            if leg != log[-1][2] and time - (swaps or [0.0])[-1] >= 0.1:
                swaps.append(time)
            log.append((time, state, leg))
    swaps = swaps[:steps]
    log.append((sim.time, None, None))
    in_order = 0
    for begin, end in pairwise(swaps):
        # The state at every 2 us of the step, then the lengths of constant pieces.
        grid = np.arange(begin + 1e-9, end, 2e-6)
        at = np.searchsorted([time for time, *_ in log], grid, side="right") - 1
        states = np.array([log[i][1] for i in at])
        edges = [0, *(np.flatnonzero(np.diff(states)) + 1), states.size]
        seen = [states[a] for a, b in pairwise(edges) if (b - a) * 2e-6 >= 2e-3]
        text = "-".join(str(state) for state in seen)
        in_order += re.sub(r"\b(\d+)(-\1\b)+", r"\1", text) == "3-7-15-16-14"
    return max(len(swaps) - 1, 0), in_order


# --- the order -----------------------------------------------------------------------------------


def test_an_independent_count_of_the_order_agrees(motion):
    complete, in_order = count_independently(motion.scene, STEPS)
    assert complete == len(motion.orders) == STEPS - 1
    assert in_order == sum(step.in_order() for step in motion.orders)


def test_a_gait_in_the_order_scores_1_and_the_others_0(name, motion):
    wanted, found = float(name == IN_ORDER), values(motion)
    assert found["in_order"] == found["in_order_standing"] == wanted
    assert (contact.sequences(motion) == {"3-7-15-16-14": 1.0}) == bool(wanted)


@pytest.mark.long("100 steps of every preset")
def test_the_independent_count_agrees_over_100_steps(name):
    recording = record(Simulator(load_scene(name)), 100, every=10**9)
    orders = step_orders(recording.events.tolist(), recording.steps["time"].tolist())
    in_order = sum(step.in_order() for step in orders)
    assert count_independently(load_scene(name), 100) == (len(orders), in_order)
    assert in_order == (99 if name == IN_ORDER else 0)


@pytest.mark.parametrize(
    ("visits", "exact", "standing"),
    [
        ("3:50 7:50 15:20 16:9 14:60", True, True),
        # Visits below 2 ms are left out, wherever they are; so many short ones of a state, too.
        ("1:1.9 3:50 1:1.9 3:9 7:50 15:20 16:9 14:60 16:1.9", True, True),
        ("3:50 7:50 15:20 16:1 14:1 16:1 14:60", False, False),
        # Events within a state are no change of state.
        ("3:1 3:1.5 3:50 7:50 15:20 16:9 14:60", True, True),
        ("3:9 1:9 3:50 7:50 15:20 16:9 14:60", False, True),
        ("1:9 7:50 15:20 16:9 14:60", False, True),
        # Consecutive short visits of 1 and 3 are one visit where both count as 3.
        ("3:1.5 1:1.5 7:50 15:20 16:9 14:60", False, True),
        ("3:50 7:50 16:9 14:60", False, False),
        ("3:50 7:50 15:1.9 16:9 14:60", False, False),
        ("3:50 7:50 15:20 16:9 14:60 16:2", False, False),
        ("3:50 4:9 7:50 15:20 16:9 14:60", False, False),
        ("", False, False),
    ],
)
def test_the_rule(visits, exact, standing):
    pairs = [visit.split(":") for visit in visits.split()]
    step = StepOrder(tuple((int(state), 1e-3 * float(ms)) for state, ms in pairs))
    assert (step.in_order(), step.in_order(standing_as_sliding=True)) == (exact, standing)
    assert sum(step.dwell.values()) == pytest.approx(sum(time for _, time in step.visits))
    assert sum(time for _, time in step.merged()) == pytest.approx(sum(step.dwell.values()))


# --- times ---------------------------------------------------------------------------------------


def test_times_in_the_states_sum_to_the_period(motion):
    for step, row in zip(motion.orders, motion.steps, strict=True):
        assert sum(step.dwell.values()) == pytest.approx(row["period"], abs=1e-12)
    times = sum(contact.dwell(motion).values())
    assert times == pytest.approx(1e3 * values(motion)["period"], abs=1e-9)


def test_double_support_and_air_are_the_times_of_their_states(motion):
    dwell = {int(state): 1e-3 * time for state, time in contact.dwell(motion).items()}
    found = values(motion)
    double = sum(time for state, time in dwell.items() if state >= 5)
    assert found["double_support"] == pytest.approx(double)
    assert found["flight"] == pytest.approx(dwell.get(0, 0.0))
    assert found["free_foot_in_air"] * found["period"] + double == pytest.approx(found["period"])
    # Samples of 1 ms; a step has some 20 changes at most that matter.
    states = motion.recording.state_number[motion.shown]
    assert np.mean(states < 5) == pytest.approx(found["free_foot_in_air"], abs=0.02)


def test_shares_of_sequences_sum_to_1(motion):
    assert sum(contact.sequences(motion).values()) == pytest.approx(1.0)


def test_speed_is_length_over_period(motion):
    found = values(motion)
    assert found["speed"] == pytest.approx(found["progress"] / found["period"])


# --- forces and torques --------------------------------------------------------------------------


def test_weight_is_that_of_table_1(motion):
    assert motion.weight == pytest.approx(64.2 * 9.81)


def test_ice_that_only_pushes_does_not_pull(motion):
    one_way = motion.scene.get("contact.law") == "push_only"
    pull, push = (contact.largest_load(motion, sign) for sign in (-1.0, 1.0))
    # Forces at the ends of a sole have rounding errors.
    assert (pull < 1e-6) == one_way
    forces = np.array([*contact.normal_forces(motion).values()])[:, motion.shown]
    assert forces.min() == pytest.approx(-pull, abs=1e-12) and forces.max() == push > 1.0


def test_the_largest_is_that_of_the_joints(motion):
    torques, found = motion.torques, values(motion)
    assert found["joint_torque"] == max(torques.values())
    assert found["ankle_torque"] == max(torques["q2"], torques["q7"])
    assert found["joint_rate"] == max(motion.peaks(motion.recording.v).values())


# --- reports -------------------------------------------------------------------------------------


def test_a_gait_that_falls_at_once_has_no_numbers():
    scene = replace(load_scene("paper"), {"control.lifting": None, "control.feedforward": None})
    still = {"still": skate(Simulator(scene), 2)}
    (found,) = summary(still)["gaits"].values()
    json.dumps(found, allow_nan=False)
    assert found["termination"] is not None
    assert found["values"]["in_order"] is found["values"]["largest_pull"] is None
    assert "still: 0 of 2 steps, ended by" in text(still)


def test_every_quantity_says_what_it_is():
    names = {each.name for each in QUANTITIES}
    assert len({each.key for each in QUANTITIES}) == len(names) == len(QUANTITIES)
    assert all(each.unit and each.definition for each in QUANTITIES)


def test_a_policy_is_held_over_its_action(random_policy):
    """Samples of 1 ms do not change when a policy acts."""
    motion = skate(Simulator(load_scene(PAPER_DAMPED)), 2, random_policy(PAPER_DAMPED))
    # No other torque acts on q13. A residual acts over 10 samples, up to the next action's first.
    residual = motion.recording.torque[:, motion.recording.index("q13")]
    changes = np.flatnonzero(np.diff(residual))
    assert changes.size > 50 and not np.any(changes % 10)


@pytest.mark.parametrize("name", ["paper", "push_only"])
def test_samples_do_not_change_the_motion(name, random_policy):
    """Steps and events have the same bits as without samples."""
    scene = load_scene(name)
    for policy in (None, random_policy(name)):
        sampled = skate(Simulator(scene), STEPS, policy).recording
        alone = record(Simulator(scene), STEPS, policy=policy)
        assert sampled.steps.tolist() == alone.steps.tolist()
        assert sampled.events.tolist() == alone.events.tolist()


def test_samples_are_those_of_the_motion(motions):
    recording = motions["paper"].recording
    alone = record(Simulator(recording.scene), STEPS)
    every = round(0.01 / 1e-3)
    np.testing.assert_array_equal(recording.q[::every], alone.q)
    np.testing.assert_array_equal(recording.contact_forces[::every], alone.contact_forces)
    assert np.diff(recording.t) == pytest.approx(1e-3)


def test_command_writes_numbers_and_pictures(tmp_path):
    command = ["gait", "--scene", IN_ORDER, "--scene", "paper_arms", "--steps", "2", "--json"]
    result = CliRunner().invoke(app, [*command, "--out", str(tmp_path / "new")])
    assert result.exit_code == 0, result.output
    found = json.loads(result.stdout.splitlines()[-1])
    assert found == json.loads((tmp_path / "new" / "gaits.json").read_text(encoding="utf-8"))
    assert list(found["gaits"]) == ["paper", "paper_arms"]
    numbers = found["gaits"]["paper"]["values"]
    assert numbers["in_order"] == 1.0 and set(numbers) == set(found["quantities"])
    for name in found["gaits"]:
        picture = tmp_path / "new" / f"gait_{name}.png"
        assert picture.read_bytes().startswith(b"\x89PNG")
    for word in ("3-7-15-16-14: 100", "2 ms", "body weights", "Visits shorter than 2 ms"):
        assert word in result.stdout


@pytest.mark.parametrize(
    "choice", [["--scene", "nope"], ["--accuracy", "nope"], ["--policy", "nope.npz"]]
)
def test_command_says_what_is_wrong(choice):
    result = CliRunner().invoke(app, ["gait", *choice])
    assert result.exit_code == 2 and result.stderr.startswith("error: ")
