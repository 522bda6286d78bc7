"""Arbitrary arguments are accepted or refused with a clear message; no motion has a NaN."""

import numpy as np
from gymnasium.error import ResetNeeded
from hypothesis import given, settings
from hypothesis import strategies as st

from skate_env import IceSkateEnv, IceSkateVectorEnv, Simulator, load_scene
from skate_env.scenes import replace
from skate_env.studies.fixtures import BLADE

FIELDS = sorted(load_scene("paper").parameters())
ANYTHING = (
    st.none()
    | st.booleans()
    | st.integers()
    | st.floats()
    | st.complex_numbers()
    | st.text()
    | st.binary()
    | st.lists(st.floats(), max_size=20)
    | st.lists(st.floats(-1e3, 1e3), min_size=10, max_size=10)
    | st.lists(st.floats(-1e3, 1e3), min_size=19, max_size=19)
    | st.dictionaries(st.text(max_size=4) | st.sampled_from(FIELDS), st.floats())
    | st.builds(object)
)
CALLS = {
    "reset": 4,
    "step": 1,
    "link_segments": 1,
    "rhs": 3,
    "guards": 3,
    "sampled": 3,
    "reset_map": 4,
    "restore": 1,
    "mass_matrix": 1,
    "bias_forces": 2,
    "energy": 2,
    "momentum": 2,
    "perturb": 2,
    "kick": 1,
}


@settings(max_examples=150, deadline=None)
@given(st.sampled_from(sorted(CALLS)), st.data())
def test_arbitrary_arguments_are_accepted_or_refused(method, data):
    sim = Simulator("paper")
    sim.step()
    before, stats = sim.snapshot(), sim.stats()
    arguments = [data.draw(ANYTHING) for _ in range(CALLS[method])]
    try:
        getattr(sim, method)(*arguments)
    except (ValueError, TypeError) as refusal:
        assert str(refusal)
        assert sim.snapshot() == before and sim.stats() == stats
    if sim.termination is None:
        assert np.isfinite(sim.q).all() and np.isfinite(sim.acceleration).all()


NAMES = st.sampled_from(["state", "params", "phase", "perturb", "reset_mask", "elapsed", "nope"])
STATES = st.dictionaries(st.sampled_from(["q", "v", "support_leg", "nope"]), ANYTHING, max_size=3)
OPTIONS = st.dictionaries(NAMES, ANYTHING | STATES, max_size=3)


@settings(max_examples=150, deadline=None)
@given(st.booleans(), ANYTHING, ANYTHING | OPTIONS, ANYTHING)
def test_arbitrary_environment_arguments_are_accepted_or_refused(many, seed, options, action):
    env = IceSkateVectorEnv(2) if many else IceSkateEnv()
    env.reset(seed=0)
    calls = [lambda: env.reset(seed=seed, options=options), lambda: env.step(action)]
    for call in calls:
        before = env.snapshot()
        try:
            observation, *_ = call()
        except (ValueError, TypeError, ResetNeeded) as refusal:
            assert str(refusal)
            assert env.snapshot() == before
        else:
            assert env.observation_space.contains(observation)


SIZES = st.floats(-1e6, 1e6) | st.floats(-1.0, 1.0) | st.sampled_from([1e6, -1e6, 5e-324, 1e-300])


@settings(max_examples=80, deadline=None)
@given(
    st.sampled_from(["paper", BLADE]),
    st.sampled_from(["fast", "balanced"]),
    st.lists(SIZES, min_size=17, max_size=17),
    st.lists(SIZES, min_size=19, max_size=19),
    st.lists(SIZES, min_size=16, max_size=16),
)
def test_extreme_states_and_torques_are_refused_or_terminate(preset, accuracy, q, v, torque):
    """Flat on the ice, so that most are valid; joints, speeds and torques up to the maximum."""
    sim = Simulator(replace(load_scene(preset), {"accuracy": accuracy, "fall": None}))
    q = [q[0], 0.0, 0.0, *q[1:]]
    try:
        sim.reset(q=q, v=v)
    except ValueError as refusal:
        assert any(word in str(refusal) for word in ("ice", "motion", "start"))
        return
    for _ in range(2):
        goes_on = sim.step(torque)
        assert goes_on == (sim.termination is None)
        assert np.isfinite(sim.q).all() and np.isfinite(sim.v).all()
        if goes_on:
            for seen in (sim.acceleration, sim.torque, sim.contact_forces, sim.head_position):
                assert np.isfinite(seen).all()
