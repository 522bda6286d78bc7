"""Derivatives of the steps of environments: states, rewards and observations."""

import itertools

import gymnasium
import numpy as np
import pytest

from skate_env import Simulator
from skate_env.environments import IceSkateVectorEnv
from skate_env.studies.fixtures import PAPER_DAMPED
from tests.differences import difference

# State and supporting leg at the start, as in an event.
START = (0.0, "", 3, 3, "right")
# The reward counts the slide of loaded feet by time steps; with fixed steps these do not move.
FIXED = {"method": "rk4", "step": 0.0005}


def made(scene="push_only", num_envs=1, **keywords):
    envs = IceSkateVectorEnv(num_envs, scene, **{"accuracy": FIXED, **keywords})
    envs.reset(seed=0, options={"perturb": 0.02})
    return envs


def actions_of(envs, steps, size=0.2):
    shape = (steps, envs.num_envs, len(envs.joint_names))
    return np.random.default_rng(1).uniform(-size, size, shape)


def test_a_state_is_that_of_the_simulator_and_what_the_task_remembers():
    """Time of the last change of contact; hips where the gait step began, and slide since then."""
    envs = made("push_only", 2, accuracy="balanced")
    _, infos = envs.reset(seed=0)
    keys, steps = ("y_position", "loaded_slide"), infos["steps"].copy()
    began = np.array([infos[key] for key in keys])
    for action in actions_of(envs, 100, 0.02):
        *_, infos = envs.step(action)
        stepped = infos["steps"] > steps
        steps = infos["steps"].copy()
        began = np.where(stepped, [infos[key] for key in keys], began)
        for i, state in enumerate(envs.state_vectors()):
            sim = envs.simulator(i)
            np.testing.assert_array_equal(state[:-3], sim.state_vector())
            events = sim.take_events()
            changes = [b[0] for a, b in itertools.pairwise([START, *events]) if a[3:] != b[3:]]
            slid = infos["loaded_slide"][i] - began[1, i]
            assert state[-3:].tolist() == [[0.0, *changes][-1], began[0, i], slid]
    assert steps.min() > 0


@pytest.mark.parametrize("mode", ["NextStep", "SameStep"])
@pytest.mark.parametrize("scene", ["push_only", "paper_arms"])
def test_results_are_those_of_a_step(scene, mode):
    """Bit for bit, through resets, whatever the number of threads."""
    keywords = {"accuracy": "balanced", "autoreset_mode": mode, "max_episode_steps": 25}
    plain, one, two = (made(scene, 3, num_threads=threads, **keywords) for threads in (None, 1, 2))
    for action in actions_of(plain, 60, 1.2):
        exact = plain.advance(action)
        *found, by = one.advance_differentiated(action)
        *again, again_by = two.advance_differentiated(action)
        for a, b, c in zip(exact, found, again, strict=True):
            assert (a == b).all() and (a == c).all()
        for name in ("A", "B", "reward_state", "reward_action", "observation", "exists"):
            assert (getattr(by, name) == getattr(again_by, name)).all()
        assert by.exists.all() or mode == "NextStep" or found[2].any()
    assert plain.snapshot() == one.snapshot() == two.snapshot()


def total(envs, start, actions):
    """Return the final state with the sum of the rewards, and the sequence of events."""
    envs.restore(start)
    rewards, passed = 0.0, []
    for action in actions:
        _, reward, *_ = envs.advance(action)
        rewards += reward[0]
        sim = envs.simulator(0)
        passed.append((sim.state_number, sim.support_leg, len(sim.take_events())))
    return np.append(envs.state_vectors()[0], rewards), tuple(passed)


def chained(envs, actions, along):
    """Return the derivative of `total` along a direction, and whether it may not exist."""
    state, reward, flagged = np.zeros(envs.state_vectors().shape[1]), 0.0, False
    for action, direction in zip(actions, along[:, 0], strict=True):
        *_, by = envs.advance_differentiated(action)
        flagged |= bool(by.nonsmooth) or not by.exists[0]
        reward += by.reward_state[0] @ state + by.reward_action[0] @ direction
        state = by.A[0] @ state + by.B[0] @ direction
    return np.append(state, reward), flagged


@pytest.mark.parametrize("scene", ["push_only", "paper_arms", PAPER_DAMPED])
def test_states_and_rewards_agree_with_differences(scene):
    """After 6 actions, by these actions, through swaps of the legs and their mirror.

    Largest error where the difference is good to 1e-8: 6e-9 of the states, 1e-10 of the rewards.
    """
    envs = made(scene, reward={"speed": 1.0, "high_speed": 1.0})
    rng, compared, legs = np.random.default_rng(2), 0, set()
    all_actions = actions_of(envs, 90)
    for k in range(0, len(all_actions), 6):
        start, actions = envs.snapshot(), all_actions[k : k + 6]
        along = rng.normal(size=actions.shape)

        def end(e, start=start, actions=actions, along=along):
            return total(envs, start, actions + e * along)

        found = difference(end)
        envs.restore(start)
        exact, flagged = chained(envs, actions, along)
        if envs.simulator(0).termination:
            break
        if flagged or found is None or found[1] > 1e-8:
            continue
        error = np.abs(found[0] - exact) / np.maximum(1.0, np.abs(exact))
        assert error.max() < 1e-7
        compared += 1
        legs.add(envs.simulator(0).support_leg)
    assert compared >= 3 and len(legs) == 2


@pytest.mark.parametrize("scene", ["push_only", "paper_arms"])
def test_observations_agree_with_differences(scene):
    """After an action; observations have 24 bits, and so have their differences."""
    envs, compared = made(scene), 0
    for action in actions_of(envs, 30):
        start, along = envs.snapshot(), np.random.default_rng(3).normal(size=action.shape)

        def seen(e, start=start, action=action, along=along):
            envs.restore(start)
            observation, *_ = envs.advance(action + e * along)
            sim = envs.simulator(0)
            return observation[0].astype(float), (sim.state_number, len(sim.take_events()))

        found = difference(seen, [0.05, 0.02], 1e-7)
        envs.restore(start)
        *_, by = envs.advance_differentiated(action)
        if found is None or found[1] > 1e-5 or by.nonsmooth or not by.exists[0]:
            continue
        exact = by.observation[0] @ by.B[0] @ along[0]
        assert np.abs(found[0] - exact).max() < 1e-5 * max(1.0, np.abs(exact).max())
        compared += 1
    assert compared >= 8


@pytest.mark.parametrize(
    ("keywords", "said"),
    [
        ({"torque_limit": 100.0}, "torque_limit"),
        ({"kick": 0.5}, "kick"),
        ({"accuracy": {"method": "rosenbrock", "tolerance": 1e-5}}, "accuracy"),
    ],
)
def test_what_has_no_derivatives_is_refused(keywords, said):
    envs = made(**keywords)
    before = envs.snapshot()
    with pytest.raises(ValueError, match=said):
        envs.advance_differentiated(actions_of(envs, 1)[0])
    assert envs.snapshot() == before


def test_the_end_of_a_robot_without_steps_has_no_derivatives():
    """As any other termination: the penalty is a jump of the reward."""
    longest = 0.095
    envs = made("paper_printed", 2, reward={"longest_step": longest}, autoreset_mode="Disabled")
    for action in actions_of(envs, 9):
        *_, terminated, _, by = envs.advance_differentiated(action)
        assert by.exists.all() and not terminated.any()
    *_, terminated, _, by = envs.advance_differentiated(actions_of(envs, 1)[0])
    assert terminated.all() and envs.simulator(0).termination == "no_step"
    assert not by.exists.any()
    for name in ("A", "B", "reward_state", "reward_action", "observation"):
        assert not getattr(by, name).any()


def test_a_reset_is_needed_first():
    envs = IceSkateVectorEnv(1)
    with pytest.raises(gymnasium.error.ResetNeeded):
        envs.advance_differentiated(actions_of(envs, 1)[0])


def test_gradients_of_a_sum_are_its_derivative():
    """Backwards through 8 steps of two environments, as forwards."""
    envs = made(PAPER_DAMPED, 2, accuracy="balanced")
    actions = actions_of(envs, 8)
    rng, steps, states = np.random.default_rng(4), [], np.zeros(envs.state_vectors().shape)
    along, forward, seen_by = rng.normal(size=actions.shape), 0.0, []
    for action, direction in zip(actions, along, strict=True):
        observations, *_, by = envs.advance_differentiated(action)
        steps.append(by)
        forward += (by.reward_state * states).sum() + (by.reward_action * direction).sum()
        states = np.einsum("nzy,ny->nz", by.A, states)
        states += np.einsum("nzm,nm->nz", by.B, direction)
        weights = rng.normal(size=observations.shape)
        forward += (weights * np.einsum("ndz,nz->nd", by.observation, states)).sum()
        seen_by.append(weights)
    gradient, backward = np.zeros_like(states), 0.0
    for by, weights, direction in zip(steps[::-1], seen_by[::-1], along[::-1], strict=True):
        gradient, by_action = by.vjp(weights, np.ones(2), gradient)
        backward += (by_action * direction).sum()
    assert abs(forward - backward) < 1e-12 * max(1.0, abs(forward))


def test_torch():
    """The function for PyTorch has the gradients of `vjp`, and its graph is cut where it ends."""
    torch = pytest.importorskip("torch")
    from skate_env.torch import step

    envs = made("push_only", 2, accuracy="balanced", autoreset_mode="SameStep", max_episode_steps=3)
    start = envs.snapshot()
    actions = torch.tensor(actions_of(envs, 4), requires_grad=True)
    states = torch.as_tensor(envs.state_vectors())
    losses = []
    for action in actions:
        observations, rewards, states, terminated, truncated = step(envs, action, states)
        losses.append(rewards.sum() + observations.sum())
    assert truncated.dtype == torch.bool and not terminated.any()
    (sum(losses)).backward()
    envs.restore(start)
    steps = [envs.advance_differentiated(a)[-1] for a in actions.detach().numpy()]
    gradient, width = np.zeros(states.shape), observations.shape[1]
    for by, found in zip(steps[::-1], actions.grad.numpy()[::-1], strict=True):
        gradient, exact = by.vjp(np.ones((2, width)), np.ones(2), gradient)
        assert np.abs(found - exact).max() <= 1e-12 * max(1.0, np.abs(exact).max())
    # The third step has begun new episodes: nothing of the first ones reaches the fourth.
    assert (steps[2].A == 0.0).all() and (steps[3].A != 0.0).any()


def test_tensors_of_a_wrong_kind_are_refused(refused):
    torch = pytest.importorskip("torch")
    from skate_env.torch import step

    envs = made("paper", 2, accuracy="balanced")
    before = envs.snapshot()
    actions, states = torch.as_tensor(actions_of(envs, 1)[0]), torch.as_tensor(envs.state_vectors())
    for call, kind, word in (
        (lambda: step(envs, actions, states[:1]), ValueError, "states has shape (1, 45)"),
        (lambda: step(envs, actions[:, :3], states), ValueError, "actions has shape (2, 3)"),
        (lambda: step(envs, actions, states.to(torch.int64)), TypeError, "states has dtype"),
        (lambda: step(envs, actions.numpy(), states), TypeError, "actions: must be a tensor"),
    ):
        refused(kind, call, word)
    assert envs.snapshot() == before


@pytest.mark.parametrize("scene", ["paper", "push_only"])
def test_an_event_at_the_first_instant_has_a_fixed_time(scene):
    """The time of the last change is then the start of the action, whatever came before.

    Exact. Elsewhere the derivative agrees with differences, see above.
    """
    envs = made(scene, 4, accuracy=1e-9)
    changed = 2 * len(envs.simulator(0).q) + 4
    rng, found, kept = np.random.default_rng(4), 0, 0
    for _ in range(60):
        starts = [envs.simulator(i).time for i in range(envs.num_envs)]
        before = envs.state_vectors()[:, changed]
        *_, by = envs.advance_differentiated(rng.uniform(-0.5, 0.5, (4, 10)))
        after = envs.state_vectors()[:, changed]
        for i, start in enumerate(starts):
            if not by.exists[i]:
                continue
            row = np.append(by.A[i, changed], by.B[i, changed])
            if after[i] == before[i]:
                assert row[changed] == 1.0 and np.count_nonzero(row) == 1
                kept += 1
            elif after[i] == start:
                assert not row.any()
                found += 1
    assert found >= 5 and kept >= 20


def test_second_derivatives_are_refused():
    # They were silently wrong: gradients were taken for constants.
    torch = pytest.importorskip("torch")
    from skate_env.torch import rollout, step

    envs, sim = made(), Simulator("paper")
    envs.reset(seed=0)
    states = torch.as_tensor(envs.state_vectors())

    def stepped(actions):
        return step(envs, actions, states)[1].square().sum()

    def rolled(torques):
        return rollout(sim, torques)[-1].square().sum()

    def mixed(actions):
        return stepped(actions) * actions.square().sum()

    def twice(loss, given):
        free = given.clone().requires_grad_()
        (gradient,) = torch.autograd.grad(loss(free), free, create_graph=True)
        torch.autograd.grad(gradient.sum(), free)

    functional = torch.autograd.functional
    actions, torques = torch.as_tensor(actions_of(envs, 1)[0]), torch.zeros(2, 16).double()
    for loss, given in ((stepped, actions), (mixed, actions), (rolled, torques)):
        for second in (twice, functional.hessian):
            with pytest.raises(RuntimeError, match="first derivatives only"):
                second(loss, given)
        for second in (functional.hvp, functional.vhp):
            with pytest.raises(RuntimeError, match="first derivatives only"):
                second(loss, given, torch.ones_like(given))
        # This way has no first derivatives either.
        with pytest.raises(RuntimeError, match="setup_context"):
            torch.func.hessian(loss)(given)


def test_gradients_by_states_keep_their_precision():
    torch = pytest.importorskip("torch")
    from skate_env.torch import step

    found = []
    for dtype in (torch.float32, torch.float64):
        envs = made()
        envs.reset(seed=0)
        actions = torch.zeros(1, 10, dtype=dtype, requires_grad=True)
        states = torch.as_tensor(envs.state_vectors()).requires_grad_()
        after = step(envs, actions, states)[2]
        # The values of the inputs are not used.
        with torch.no_grad():
            actions += 1.0
        after.square().sum().backward()
        found.append(states.grad)
    assert found[0].dtype == torch.float64
    torch.testing.assert_close(*found, rtol=0.0, atol=0.0)
