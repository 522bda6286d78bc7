"""Cards of gaits: laws that their lines obey, and what they require."""

import math
import re
from types import SimpleNamespace

import numpy as np
import pytest
from typer.testing import CliRunner

from skate_env import IceSkateEnv, Simulator, load_scene, scene_names
from skate_env.gait import contact, skate
from skate_env.scenes import replace
from training.gaits import measures, robustness
from training.gaits.__main__ import app, table
from training.gaits.limits import HUMAN, LINES, REQUIRED, Limit

TWO_WAY = ["paper", "paper_printed", "paper_arms"]
STEPS = 5
# Units of the feedforward torques in an observation [N m], from Eqs. 16 to 22.
FEEDFORWARD_UNITS = {1: 100.0, 2: 205.0, 3: 50.0, 5: 100.0, 6: 20.0, 7: 50.0, 8: 30.0}


@pytest.fixture(scope="module")
def motions():
    """Motions of all presets."""
    return {name: skate(Simulator(load_scene(name)), STEPS) for name in scene_names()}


@pytest.fixture(params=scene_names())
def motion(request, motions):
    return motions[request.param]


def value(motion, key):
    (line,) = (line for line in LINES if line.key == key)
    return line.measure(motion)


# --- contact -------------------------------------------------------------------------------------


def test_time_in_15_is_that_of_the_state(motion):
    dwell = contact.dwell(motion)
    assert dwell.get("15", 0.0) == pytest.approx(value(motion, "time_in_15"))


def test_last_states_are_shares(motion):
    shares = [measures.share_ending_in(motion, state) for state in range(21)]
    assert sum(shares) == pytest.approx(1.0)
    assert shares[14] == value(motion, "swap_from_14")
    assert shares[14] == 1.0 or value(motion, "in_order") == 0.0


def test_ice_that_only_pushes_has_its_pressure_within_the_soles(motion):
    one_way = motion.scene.get("contact.law") == "push_only"
    assert (value(motion, "pressure_outside") == 0.0) == one_way


def test_excess_of_the_centre_of_pressure_follows_from_moments(motions):
    """Net force times its place is the sum of moments about the heel."""
    motion = motions["paper_arms"]
    force = motion.recording.contact_forces[motion.shown][:, :, 2:]
    net, moment = force.sum(axis=2), measures.sole(motion) * force[:, :, 1]
    excess = measures.excess(motion)
    loaded = ~np.isnan(excess)
    assert loaded.any() and np.all(np.abs(net[loaded]) >= measures.LOADED * motion.weight)
    place = moment[loaded] / net[loaded]
    outside = np.maximum(np.maximum(-place, place - measures.sole(motion)), 0.0)
    np.testing.assert_allclose(excess[loaded], outside, atol=1e-12)


def test_heel_first_is_how_the_foot_lies_at_the_landing(motions):
    """Of the two gaits one lands toes up; the toe of the other is below the ice."""
    for name, wanted in (("paper_printed", 1.0), ("paper", 0.0)):
        assert value(motions[name], "heel_first") == wanted
        sim = Simulator(load_scene(name))
        toes = []
        while len(toes) < STEPS and sim.step():
            if any(event[2] < 5 <= event[3] for event in sim.take_events()):
                toes.append(sim.gaps()[1, 1])
        assert (np.median(toes) > 0.0) == bool(wanted)


# --- torques, lift and work ----------------------------------------------------------------------


def sampled(scene, steps):
    """Observation, total torque and state of every millisecond of a motion's steps."""
    sim = Simulator(scene)
    names = list(IceSkateEnv(scene).observation_names)
    rows, made = [], 0
    while made < steps:
        rows.append((sim.time, sim.state_number, sim.torque, sim.observation()))
        assert sim.advance(1e-3 * len(rows))
        made += len(sim.take_steps())
    t, state, torque, observation = map(np.array, zip(*rows, strict=True))
    feedforward = np.zeros_like(torque)
    for joint, unit in FEEDFORWARD_UNITS.items():
        column, entry = sim.coordinate_names.index(f"q{joint}"), f"feedforward.tau{joint}"
        if entry in names:
            feedforward[:, column] = unit * observation[:, names.index(entry)]
    return SimpleNamespace(
        t=t,
        state=state,
        names=sim.coordinate_names,
        feedforward=feedforward,
        feedback=torque - feedforward,
    )


@pytest.mark.parametrize("name", TWO_WAY)
def test_feedback_does_not_act_where_the_paper_has_none(name):
    """Lifting acts between the head and the supporting ankle: not on q1, q5, q6, q7."""
    found = sampled(load_scene(name), STEPS)
    for joint in ("q1", "q5", "q6", "q7"):
        column = found.names.index(joint)
        assert np.abs(found.feedforward[:, column]).max() > 1.0
        # Single precision of the observation: measured 3e-6.
        assert np.abs(found.feedback[:, column]).max() < 2e-5


def test_units_of_the_feedforward_are_those_of_the_observation():
    entries = IceSkateEnv("paper_arms")._batch.observation_entries()
    found = {
        int(name.removeprefix("feedforward.tau")): float(meaning.split()[-3])
        for name, meaning, *_ in entries
        if name.startswith("feedforward.")
    }
    assert found == FEEDFORWARD_UNITS


def test_tau1_is_that_of_eq_16(motions):
    """-100 cos(pi (t - t2)) in states 14 and 16, zero elsewhere."""
    motion = motions["paper"]
    recording = motion.recording
    tau1 = recording.torque[:, recording.index("q1")]
    begins = [e[0] for e in recording.events.tolist() if e[3] in (14, 16) and e[2] not in (14, 16)]
    t, state = recording.t, recording.state_number
    for i in np.flatnonzero(motion.shown):
        if state[i] in (14, 16):
            t2 = max(time for time in begins if time <= t[i])
            assert tau1[i] == pytest.approx(-100.0 * math.cos(math.pi * (t[i] - t2)), 1e-4)
        else:
            assert tau1[i] == 0.0


def test_work_of_tau1_converges(motions):
    """A fifth of the sample period gives the same work."""
    motion = motions["paper"]
    sim = Simulator(motion.scene)
    column = sim.coordinate_names.index("q1")
    begin, end = motion.swaps[0], motion.swaps[-1]
    work, h = 0.0, 2e-4
    for i in range(1, int(end / h) + 1):
        sim.advance(i * h)
        if begin <= sim.time < end:
            work += h * sim.torque[column] * sim.v[column]
    assert measures.work_of_tau1(motion) == pytest.approx(work / (STEPS - 1), rel=0.02)


@pytest.mark.parametrize("name", ["paper", "paper_arms"])
def test_lift_is_stiffness_times_depth_minus_damping_times_rate(motions, name):
    motion = motions[name]
    recording = motion.recording
    head, t = recording.head[:, 2], recording.t
    sim = Simulator(motion.scene)
    rise = [sim.link_segments(q)[[1, 16], [0, 1], 2] for q in recording.q]
    rate = np.gradient(np.diff(rise, axis=1)[:, 0], t)
    lifting = motion.scene.get("control.lifting")
    damping = (motion.scene.get("stabilizers.head_damping") or {"z": 0.0})["z"]
    force = lifting["K_p"][2] * (lifting["height"] - head) - damping * rate
    # Where the state does not change, the difference quotient of the samples is the rate.
    state = recording.state_number
    still = np.zeros(state.size, bool)
    still[1:-1] = (state[1:-1] == state[:-2]) & (state[1:-1] == state[2:]) & (state[1:-1] > 0)
    still &= motion.shown
    lift = np.zeros(state.size)
    lift[motion.shown] = measures.lift(motion)
    difference = np.abs(lift - force / motion.weight)[still]
    assert np.median(difference) < 0.02 * np.abs(lift[still]).max()
    # The error of the quotient, where the head is damped vertically.
    assert damping or difference.max() < 1e-5


def test_numbers_of_the_scene(motion):
    foot, lifting = motion.scene.get("body.foot"), motion.scene.get("control.lifting")
    assert value(motion, "sole") == pytest.approx(foot["toe"] + foot["heel"])
    assert value(motion, "target_height") == lifting["height"]
    assert value(motion, "target_ahead") == lifting["ahead"]


# --- cards ---------------------------------------------------------------------------------------


def test_limits():
    assert Limit(at_most=1.0).met(1.0) and not Limit(at_most=1.0).met(1.1)
    assert Limit(0.2, 0.3).met(0.2) and not Limit(0.2, 0.3).met(0.1)
    assert not Limit(at_most=1.0).met(math.nan)


def test_every_line_says_what_it_is():
    keys = {line.key for line in LINES}
    assert len(keys) == len({line.name for line in LINES}) == len(LINES)
    assert all(line.unit and line.definition for line in LINES)
    assert {*REQUIRED, *HUMAN} <= keys


def test_a_gait_that_falls_at_once_meets_nothing():
    scene = replace(load_scene("paper"), {"control.lifting": None, "control.feedforward": None})
    runs = robustness.measure(scene, 2, lambda _: None)
    assert runs.survived == runs.at_least == 0.0 and set(runs.made.values()) == {0.0}
    # Wilson's interval of 0 of 256: z^2 / (256 + z^2).
    assert runs.at_most == pytest.approx(0.0148, abs=5e-5)
    card = SimpleNamespace(motion=skate(Simulator(scene), 2), runs=runs)
    rows = {name: cells for name, *cells in table({"still": card}).rows}
    assert rows["share of steps in the order 3-7-15-16-14-3"] == ["1", "", "-*"]
    assert rows["share of steps made, reference"] == ["1", "", "0*"]
    assert rows["the same, at least"] == ["≥ 0.9", "", "0*"]


def test_command_writes_tables_and_pictures(tmp_path):
    command = ["--scene", "paper", "--scene", "paper_arms", "--steps", "2"]
    result = CliRunner().invoke(app, [*command, "--out", str(tmp_path / "new")])
    assert result.exit_code == 0, result.output
    page = (tmp_path / "new" / "gaits.md").read_text(encoding="utf-8")
    pictures = re.findall(r"\]\((.*\.png)\)", page)
    assert len(pictures) == 2
    for picture in pictures:
        assert (tmp_path / "new" / picture).read_bytes().startswith(b"\x89PNG")
    for word in (
        "3-7-15-16-14-3",
        "2 ms",
        "body weights",
        "| share of steps made, reference | 1 |",
    ):
        assert word in page
    assert re.search(r"perturbed starts that make all steps +0\.9\d+ +1\n", result.stdout)
    assert "Visits shorter than 2 ms" in result.stdout


def test_command_says_what_is_wrong():
    result = CliRunner().invoke(app, ["--scene", "nope"])
    assert result.exit_code == 2 and result.stderr.startswith("error: ")
