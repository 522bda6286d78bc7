"""The card of a gait: laws that its lines obey, and a count of the order by other means."""

import json
import math
import re
from itertools import pairwise

import numpy as np
import pytest
from typer.testing import CliRunner

from skate_env import IceSkateEnv, Simulator, load_scene, scene_names
from skate_env.cli import app
from skate_env.gait import Limit, StepOrder, contact, effort, robustness, skate, step_orders
from skate_env.gait.card import Card
from skate_env.gait.lines import LINES
from skate_env.gait.motion import FEEDFORWARD_UNITS
from skate_env.gait.report import summary, text
from skate_env.gait.tables import ROBUSTNESS, TABLES
from skate_env.replay import record
from skate_env.scenes import replace
from skate_env.studies.fixtures import PAPER_DAMPED

# The preset in the order of the paper.
IN_ORDER = "paper"
TWO_WAY = ["paper", "paper_printed", "paper_arms"]
SCENES = scene_names()
STEPS = 5


@pytest.fixture(scope="module")
def cards():
    """Cards of all presets, without perturbed starts."""
    motions = {name: skate(Simulator(load_scene(name)), STEPS) for name in SCENES}
    return {name: Card(name, motion, {}) for name, motion in motions.items()}


@pytest.fixture(params=SCENES)
def card(request, cards):
    return cards[request.param]


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


def test_an_independent_count_of_the_order_agrees(card):
    scene = card.motion.recording.scene
    complete, in_order = count_independently(scene, STEPS)
    assert complete == len(card.motion.orders) == STEPS - 1
    assert in_order == sum(step.in_order() for step in card.motion.orders)


def test_a_gait_in_the_order_scores_1_and_the_others_0(card):
    wanted = 1.0 if card.name == IN_ORDER else 0.0
    assert card.numbers["in_order"] == card.numbers["in_order_standing"] == wanted
    assert card.numbers["swap_from_14"] == 1.0 or not wanted


@pytest.mark.long("100 steps of every preset")
@pytest.mark.parametrize("name", SCENES)
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


def test_times_in_the_states_sum_to_the_period(card):
    for step, row in zip(card.motion.orders, card.motion.steps, strict=True):
        assert sum(step.dwell.values()) == pytest.approx(row["period"], abs=1e-12)
    dwell = card.tables["dwell"]
    assert sum(dwell.values()) == pytest.approx(1e3 * card.numbers["period"], abs=1e-9)
    assert dwell.get("15", 0.0) == pytest.approx(card.numbers["time_in_15"])


def test_double_support_and_air_are_the_times_of_their_states(card):
    dwell = {int(state): time for state, time in card.tables["dwell"].items()}
    double = 1e-3 * sum(time for state, time in dwell.items() if state >= 5)
    assert card.numbers["double_support"] == pytest.approx(double)
    air = card.numbers["free_foot_in_air"] * card.numbers["period"]
    assert air + double == pytest.approx(card.numbers["period"])
    # Samples of 1 ms; a step has some 20 changes at most that matter.
    states = card.motion.samples.state_number[card.motion.shown]
    assert np.mean(states < 5) == pytest.approx(card.numbers["free_foot_in_air"], abs=0.02)


def test_last_states_are_shares(card):
    assert sum(card.tables["last_state"].values()) == pytest.approx(1.0)
    assert card.tables["last_state"].get("14", 0.0) == card.numbers["swap_from_14"]


# --- forces and torques --------------------------------------------------------------------------


def test_weight_is_that_of_table_1(card):
    assert card.motion.weight == pytest.approx(64.2 * 9.81)


def test_ice_that_only_pushes_does_not_pull(card):
    pulls = [*card.tables["end_pull"].values(), *card.tables["end_mean_pull"].values()]
    one_way = card.motion.scene.get("contact.law") == "push_only"
    # Forces at the ends of a sole have rounding errors.
    assert (max(pulls) < 1e-6) == one_way
    assert (card.numbers["pressure_outside"] == 0.0) == one_way
    assert card.numbers["largest_pull"] == max(card.tables["end_pull"].values())
    for end, mean in card.tables["end_mean_pull"].items():
        assert mean <= card.tables["end_pull"][end]


def test_excess_of_the_centre_of_pressure_follows_from_moments(cards):
    """Net force times its place is the sum of moments about the heel."""
    motion = cards["paper_arms"].motion
    force = motion.samples.contact_forces[motion.shown][:, :, 2:]
    net, moment = force.sum(axis=2), contact.sole(motion) * force[:, :, 1]
    excess = contact.excess(motion)
    loaded = ~np.isnan(excess)
    assert loaded.any() and np.all(np.abs(net[loaded]) >= contact.LOADED * motion.weight)
    place = moment[loaded] / net[loaded]
    outside = np.maximum(np.maximum(-place, place - contact.sole(motion)), 0.0)
    np.testing.assert_allclose(excess[loaded], outside, atol=1e-12)


@pytest.mark.parametrize("name", TWO_WAY)
def test_feedback_does_not_act_where_the_paper_has_none(cards, name):
    """Lifting acts between the head and the supporting ankle: not on q1, q5, q6, q7."""
    motion = cards[name].motion
    for joint in ("q1", "q5", "q6", "q7"):
        column = motion.recording.index(joint)
        assert np.abs(motion.feedforward[:, column]).max() > 1.0
        # Single precision of the observation: measured 3e-6.
        assert np.abs(motion.feedback[:, column]).max() < 2e-5


def test_units_of_the_feedforward_are_those_of_the_observation():
    entries = IceSkateEnv("paper_arms")._batch.observation_entries()
    found = {
        int(name.removeprefix("feedforward.tau")): float(meaning.split()[-3])
        for name, meaning, *_ in entries
        if name.startswith("feedforward.")
    }
    assert found == FEEDFORWARD_UNITS


def test_tau1_is_that_of_eq_16(cards):
    """-100 cos(pi (t - t2)) in states 14 and 16, zero elsewhere."""
    motion = cards[IN_ORDER].motion
    recording = motion.recording
    tau1 = motion.feedforward[:, recording.index("q1")]
    begins = [e[0] for e in recording.events.tolist() if e[3] in (14, 16) and e[2] not in (14, 16)]
    t, state = motion.samples.t, motion.samples.state_number
    for i in np.flatnonzero(motion.shown):
        if state[i] in (14, 16):
            t2 = max(time for time in begins if time <= t[i])
            assert tau1[i] == pytest.approx(-100.0 * math.cos(math.pi * (t[i] - t2)), 1e-4)
        else:
            assert tau1[i] == 0.0


def test_work_of_tau1_converges(cards):
    """A fifth of the sample period gives the same work."""
    motion = cards[IN_ORDER].motion
    sim = Simulator(motion.recording.scene)
    column = sim.coordinate_names.index("q1")
    begin, end = motion.swaps[0], motion.swaps[-1]
    work, h = 0.0, 2e-4
    for i in range(1, int(end / h) + 1):
        sim.advance(i * h)
        if begin <= sim.time < end:
            work += h * sim.torque[column] * sim.v[column]
    assert effort.work_of_tau1(motion) == pytest.approx(work / (STEPS - 1), rel=0.02)


@pytest.mark.parametrize("name", ["paper", "paper_arms"])
def test_lift_is_stiffness_times_depth_minus_damping_times_rate(cards, name):
    motion = cards[name].motion
    head, t = motion.samples.head, motion.samples.t
    sim = Simulator(motion.recording.scene)
    rise = [sim.link_segments(q)[[1, 16], [0, 1], 2] for q in motion.samples.q]
    rate = np.gradient(np.diff(rise, axis=1)[:, 0], t)
    lifting = motion.scene.get("control.lifting")
    damping = (motion.scene.get("stabilizers.head_damping") or {"z": 0.0})["z"]
    force = lifting["K_p"][2] * (lifting["height"] - head) - damping * rate
    # Where the state does not change, the difference quotient of the samples is the rate.
    state = motion.samples.state_number
    still = np.zeros(state.size, bool)
    still[1:-1] = (state[1:-1] == state[:-2]) & (state[1:-1] == state[2:]) & (state[1:-1] > 0)
    still &= motion.shown
    lift = np.zeros(state.size)
    lift[motion.shown] = effort.lift(motion)
    difference = np.abs(lift - force / motion.weight)[still]
    assert np.median(difference) < 0.02 * np.abs(lift[still]).max()
    # The error of the quotient, where the head is damped vertically.
    assert damping or difference.max() < 1e-5


def test_totals_are_bounded_by_their_parts(card):
    tables = card.tables
    for joint, total in tables["total"].items():
        assert total <= tables["feedforward"][joint] + tables["feedback"][joint] + 1e-9
    assert card.numbers["joint_rate"] == max(tables["rates"].values())
    assert card.numbers["ankle_torque"] == max(tables["total"]["q2"], tables["total"]["q7"])


# --- body and landing ----------------------------------------------------------------------------


def test_numbers_of_the_scene(card):
    scene = card.motion.scene
    foot, lifting = scene.get("body.foot"), scene.get("control.lifting")
    assert card.numbers["sole"] == pytest.approx(foot["toe"] + foot["heel"])
    assert card.numbers["target_height"] == lifting["height"]
    assert card.numbers["target_ahead"] == lifting["ahead"]
    assert card.numbers["standing_height"] == pytest.approx(1.70)


def test_heel_first_is_how_the_foot_lies_at_the_landing(cards):
    """Of the two gaits one lands toes up; the toe of the other is below the ice."""
    for name, wanted in (("paper_printed", 1.0), (IN_ORDER, 0.0)):
        assert cards[name].numbers["heel_first"] == wanted
        sim = Simulator(load_scene(name))
        toes = []
        while len(toes) < STEPS and sim.step():
            if any(event[2] < 5 <= event[3] for event in sim.take_events()):
                toes.append(sim.gaps()[1, 1])
        assert (np.median(toes) > 0.0) == bool(wanted)


# --- cards ---------------------------------------------------------------------------------------


def test_a_gait_that_falls_at_once_has_no_numbers():
    scene = replace(load_scene("paper"), {"control.lifting": None, "control.feedforward": None})
    runs = {"balanced": robustness.measure(scene, 2, None, "balanced", lambda _: None)}
    card = Card("still", skate(Simulator(scene), 2), runs)
    assert card.motion.recording.metadata["termination"] is not None
    (said,) = summary([card])["cards"].values()
    json.dumps(said, allow_nan=False)
    assert said["values"]["in_order"] is said["values"]["largest_pull"] is None
    assert said["values"]["survived"] == {"balanced": 0.0}
    assert not said["met"]["required"]["in_order"]
    assert "still: 0 of 2 steps, ended by" in text([card])


def test_limits():
    assert Limit(at_most=1.0).met(1.0) and not Limit(at_most=1.0).met(1.1)
    assert Limit(0.2, 0.3).met({"a": 0.2, "b": 0.3}) and not Limit(0.2, 0.3).met({"a": 0.1})
    assert not Limit(at_most=1.0).met(math.nan) and not Limit(at_most=1.0).met({})


def test_every_line_says_what_it_is():
    lines = [*LINES, *TABLES, *ROBUSTNESS]
    assert len({line.key for line in lines}) == len({line.name for line in lines}) == len(lines)
    assert all(line.unit and line.definition for line in lines)


def test_a_policy_is_held_over_its_action(random_policy):
    """Samples of 1 ms do not change when a policy acts."""
    policy = random_policy(PAPER_DAMPED)
    motion = skate(Simulator(load_scene(PAPER_DAMPED)), 2, policy)
    samples, column = motion.samples, motion.recording.index("q13")
    # No other torque acts on q13. A residual acts over 10 samples, up to the next action's first.
    np.testing.assert_allclose(samples.torque[:, column], samples.residual[:, column], rtol=1e-12)
    changes = np.flatnonzero(np.diff(samples.residual[:, column]))
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


def test_samples_are_those_of_the_motion(cards):
    motion = cards["paper"].motion
    alone = record(Simulator(motion.recording.scene), STEPS)
    every = round(0.01 / 1e-3)
    # The last sample of a recording is the end.
    np.testing.assert_array_equal(motion.samples.q[::every], alone.q[:-1])
    np.testing.assert_array_equal(motion.samples.contact_forces[::every], alone.contact_forces[:-1])
    assert np.diff(motion.samples.t) == pytest.approx(1e-3)


def test_command_writes_tables_and_pictures(tmp_path):
    command = ["gait", "--scene", IN_ORDER, "--scene", "paper_arms", "--steps", "2", "--json"]
    result = CliRunner().invoke(app, [*command, "--out", str(tmp_path / "new")])
    assert result.exit_code == 0, result.output
    said = json.loads(result.stdout.splitlines()[-1])
    assert said == json.loads((tmp_path / "new" / "gaits.json").read_text(encoding="utf-8"))
    assert list(said["cards"]) == ["paper", "paper_arms"]
    values = said["cards"]["paper"]["values"]
    assert values["in_order"] == 1.0 and set(values) == set(said["lines"])
    assert list(values["survived"]) == ["balanced", "1e-07", "reference"]
    assert values["survived"]["balanced"] == 20.0
    assert values["perturbed_in_order_standing"]["reference"] == 1.0
    page = (tmp_path / "new" / "gaits.md").read_text(encoding="utf-8")
    for picture in re.findall(r"\]\((.*\.png)\)", page):
        assert (tmp_path / "new" / picture).read_bytes().startswith(b"\x89PNG")
    for word in ("3-7-15-16-14-3", "2 ms", "body weights", "| steps made, reference | 1 |"):
        assert word in page
    assert "Visits shorter than 2 ms" in result.stdout


@pytest.mark.parametrize(
    "choice", [["--scene", "nope"], ["--accuracy", "nope"], ["--policy", "nope.npz"]]
)
def test_command_says_what_is_wrong(choice):
    result = CliRunner().invoke(app, ["gait", *choice])
    assert result.exit_code == 2 and result.stderr.startswith("error: ")
