"""Parts of the benchmark, and a quick run of it. Timings are not asserted."""

import json
import math
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env
from typer.testing import Result

from skate_env import Scene, Simulator, load_scene
from skate_env.environments import PAPER_ACTIONS
from skate_env.scenes import replace
from skate_env.studies.motions.mujoco_model import PYRAMIDAL, Setting
from tests.bench import bodies, environments, peers, scaling, states, suite, table
from tests.bench.mujoco_env import MujocoSkateEnv
from tests.bench.table import Entry, Group, Row
from tests.commands import invoke

PEERS = ("mujoco", "pinocchio", "pydrake.all")
GROUPS = {
    suite.EVALUATIONS,
    suite.STEPS,
    suite.ENVIRONMENTS,
    suite.LOCATED_STEPS,
    suite.MORE_ENVIRONMENTS,
    suite.MORE_THREADS,
    suite.MORE_FREEDOM,
    suite.RESETS,
    suite.DERIVATIVES,
}


# --- a quick run ---------------------------------------------------------------------------------


def run(*arguments: object) -> Result:
    return invoke("bench", *arguments)


def last_line(result: Result) -> dict[str, Any]:
    assert result.exit_code == 0, result.output

    def refuse(constant: str) -> None:
        raise AssertionError(f"{constant} is not JSON")

    said: dict[str, Any] = json.loads(result.stdout.splitlines()[-1], parse_constant=refuse)
    return said


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("bench") / "new" / "folder"


@pytest.fixture(scope="module")
def result(folder: Path) -> Result:
    """One quick run with all installed libraries."""
    return run("--quick", "--json", "--out", folder)


@pytest.fixture(scope="module")
def said(result: Result) -> dict[str, Any]:
    return last_line(result)


@pytest.fixture(scope="module")
def bare() -> Result:
    """Run once more where no other library is found."""
    with pytest.MonkeyPatch.context() as patch:
        for name in PEERS:
            patch.setitem(sys.modules, name, None)
        return run("--quick", "--json")


def rows(said: dict[str, Any]) -> Iterator[dict[str, Any]]:
    for group in said["groups"].values():
        yield from group["rows"]


def test_every_group_has_figures_that_are_finite_and_positive(said: dict[str, Any]) -> None:
    assert set(said["groups"]) == GROUPS
    for row in rows(said):
        if row["reason"] is None:
            assert 0.0 < row["time"] < 10.0, row
            assert 0.0 < row["ratio"] < math.inf, row
            assert row["what"] and row["tool"], row


def test_first_row_of_a_case_is_what_others_are_compared_with(said: dict[str, Any]) -> None:
    for group in said["groups"].values():
        first: dict[str, dict[str, Any]] = {}
        for row in group["rows"]:
            one = first.setdefault(row["case"], row)
            if row["reason"] is None:
                assert row["ratio"] == row["time"] / one["time"]


def test_other_libraries_are_measured_in_every_state(said: dict[str, Any]) -> None:
    installed = {(row["case"], row["label"]) for row in rows(said) if row["reason"] is None}
    for kind in states.EVALUATED:
        assert {(kind.name, "IceSkate"), (kind.name, "MuJoCo")} <= installed
    for kind in states.STEPPED:
        assert {(kind.name, "IceSkate"), (kind.name, "MuJoCo, Euler")} <= installed
    labels = {label for case, label in installed if case == environments.case_of("fast")}
    assert {environments.MUJOCO_ENV, environments.ROLLOUT, environments.HUMANOID} <= labels
    for row in rows(said):
        if row["reason"] is None and row["label"].startswith("MuJoCo"):
            assert row["tool"].startswith("MuJoCo ")
            assert row["tool"].split()[1] == said["stamp"]["mujoco"]


def test_folder_holds_tables_json_and_picture(folder: Path, said: dict[str, Any]) -> None:
    names = {"performance.md", "performance.json", "performance.png"}
    assert {path.name for path in folder.iterdir()} == names
    assert (folder / "performance.png").read_bytes().startswith(b"\x89PNG")
    assert json.loads((folder / "performance.json").read_text(encoding="utf-8")) == said
    fragment = (folder / "performance.md").read_text(encoding="utf-8")
    assert fragment.startswith("By `python -m tests.bench --quick`.")
    assert "### Derivatives" in fragment and said["stamp"]["machine"] in fragment


def test_missing_peers_are_named_and_nothing_fails(bare: Result) -> None:
    said = last_line(bare)
    reasons = {row["reason"] for row in rows(said)} - {None}
    assert reasons == {f"{name} is not installed" for name in ("mujoco", "pin", "drake")}
    for row in rows(said):
        if row["reason"] is None:
            assert row["tool"] == "IceSkate" and row["time"] > 0.0
        else:
            assert row["time"] is None and row["ratio"] is None
    printed = " ".join(bare.stdout.split())
    missing = "Humanoid-v5: not measured; mujoco is not installed"
    assert f"one environment step, `fast`: {missing}" in printed


def test_help_shows_examples() -> None:
    result = run("--help")
    assert result.exit_code == 0 and result.stdout.count("\n    python -m tests.bench") >= 3


def test_file_in_place_of_the_folder_is_one_clear_line(tmp_path: Path) -> None:
    (tmp_path / "taken").write_text("")
    result = run("--quick", "--out", tmp_path / "taken")
    assert result.exit_code == 2 and result.stderr.startswith("error: ")


# --- timing in the engine -------------------------------------------------------------------

WORK = ("rhs", "step", "batch")


@pytest.mark.parametrize("accuracy", ["fast", "balanced"])
@pytest.mark.parametrize("work", WORK)
def test_timing_does_not_change_the_simulator(work: str, accuracy: str) -> None:
    sim = Simulator(replace(load_scene("paper"), {"accuracy": accuracy}))
    sim.advance(0.2)
    before = sim.snapshot()
    assert 0.0 < sim.measure(work, 3) < 1.0
    assert sim.snapshot() == before


def test_invalid_measurements_are_refused(refused: Any) -> None:
    sim = Simulator("push_only")
    refused(ValueError, lambda: sim.measure("sleep", 1), "sleep", *WORK)
    refused(ValueError, lambda: sim.measure("rhs", 0), "repeats = 0", "from 1 to")
    refused(ValueError, lambda: sim.measure("rhs", 2**32), "repeats", "from 1 to")
    refused(TypeError, lambda: sim.measure("rhs", 1.5), "repeats = 1.5", "an int")
    refused(TypeError, lambda: sim.measure("rhs", True), "repeats = True", "an int")
    refused(TypeError, lambda: sim.measure(1, 1), "work = 1", "a str")
    while sim.step():
        pass
    refused(ValueError, lambda: sim.measure("rhs", 1), "fall")
    refused(ValueError, lambda: sim.measure("step", 1), "fall")


# --- states and bodies ---------------------------------------------------------------------------


@pytest.mark.parametrize("kind", states.EVALUATED, ids=lambda kind: kind.name)
def test_states_are_of_their_kind_and_mujoco_has_the_same_contacts(kind: states.Kind) -> None:
    setting = Setting("Euler", states.STEP, PYRAMIDAL, "default")
    for sim in states.find(kind, 3, "balanced"):
        assert sim.state_name in kind.states
        loads = sim.contact_forces[:, 2:]
        assert (loads >= 0.0).all() and (loads > 0.0).sum() == states.touching(sim)
        (body,) = bodies.with_equal_contacts([(sim, bodies.MujocoBody(sim, setting))])
        assert body.contacts == states.touching(sim)
        bodies.PinocchioBody(sim)


def test_landing_is_a_step_in_which_the_heel_strikes() -> None:
    for sim in states.find(states.STEPPED[-1], 3, "fast"):
        sim.take_events()
        sim.advance(sim.time + states.STEP)
        assert "free heel lands" in [what for _, what, *_ in sim.take_events()]


def test_another_body_is_not_measured(monkeypatch: pytest.MonkeyPatch) -> None:
    def heavier(scene: Scene) -> str:
        return to_mjcf(scene.with_values({"body.head.mass": 5.0}))

    to_mjcf = bodies.to_mjcf
    (sim,) = states.find(states.EVALUATED[0], 1, "balanced")
    monkeypatch.setattr(bodies, "to_mjcf", heavier)
    with pytest.raises(RuntimeError, match="Pinocchio has another body"):
        bodies.PinocchioBody(sim)


def test_a_state_without_a_motion_is_reported() -> None:
    with pytest.raises(RuntimeError, match="0 states of nowhere in push_only; wanted 1"):
        states.find(states.Kind("nowhere", "push_only", ("flat/flat",)), 1, "fast")


# Positions are unbounded.
@pytest.mark.filterwarnings("ignore:.*A Box observation space")
def test_the_mujoco_environment_passes_the_checker() -> None:
    env = MujocoSkateEnv(load_scene("push_only"))
    check_env(env, skip_render_check=True)
    ours = gymnasium.make("IceSkate-v0", scene="push_only", **PAPER_ACTIONS)
    assert env.action_space == ours.action_space
    lengths = []
    for _ in range(2):
        env.reset(seed=3)
        lengths.append(
            next(
                i for i in range(1000) if env.step(np.zeros(env.action_space.shape, np.float32))[2]
            )
        )
        # Without a controller it falls.
        assert env.data.xpos[env.model.body("head").id, 2] < 1.0
    assert lengths[0] == lengths[1] > 10


def test_a_bouncing_foot_is_not_compared() -> None:
    setting = Setting("Euler", states.STEP, PYRAMIDAL, "default")
    (sim,) = states.find(states.EVALUATED[1], 1, "balanced")
    body = bodies.MujocoBody(sim, setting)
    body.data.qpos[1] += 0.01
    body.mj.mj_forward(body.model, body.data)
    with pytest.raises(peers.Unavailable, match="as many contacts"):
        bodies.with_equal_contacts([(sim, body)])


# --- arithmetic ----------------------------------------------------------------------------------


def test_times_are_those_of_a_unit_and_ratios_those_to_the_first_of_a_case() -> None:
    entries = [
        Entry("a", "ours", "us", "", lambda: 1_000, per=10.0),
        Entry("a", "theirs", "them", "", lambda: 3_000, per=10.0),
        Entry("a", "missing", "none", "", reason="not here"),
        Entry("b", "ours", "us", "", lambda: 500, per=1.0),
    ]
    group = table.measure("Title", "one", entries, 2)
    assert [row.time for row in group.rows] == pytest.approx([1e-7, 3e-7, None, 5e-7])
    assert [row.ratio for row in group.rows] == pytest.approx([1.0, 3.0, None, 1.0])
    assert group.rows[2].reason == "not here" and group.time_error == 0.0


def test_missing_peer_becomes_a_row() -> None:
    def make() -> list[Entry]:
        peers.package("no_such_module", "no-such-package")
        return []

    (entry,) = table.attempted("case", "label", "tool", make)
    assert entry.reason == "no-such-package is not installed" and entry.block is None


def test_scaling_is_the_rate_a_thread() -> None:
    made = [
        Row(scaling.threads_case(64), f"{n}", "us", "", time=t, size=float(n))
        for n, t in ((1, 4e-6), (2, 2e-6), (4, 2e-6))
    ]
    assert scaling.scaling(Group("", "", 1, made), scaling.threads_case(64)) == {
        1: 1.0,
        2: 1.0,
        4: 0.5,
    }


def test_documentation_holds_the_tables() -> None:
    docs = Path(__file__).parents[1] / "docs"
    made = (docs / "generated" / "performance.md").read_text(encoding="utf-8")
    assert made.startswith("By `python -m tests.bench`.") and "### Environments by error" in made
    assert "](generated/performance.md)" in (docs / "performance.md").read_text(encoding="utf-8")
