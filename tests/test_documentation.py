"""The documents agree with the code: IceSkate-v0, states of the paper, links, examples."""

import ast
import doctest
import inspect
import json
import re
import warnings
from enum import Enum
from importlib import import_module
from itertools import pairwise
from pathlib import Path

import gymnasium
import numpy as np
import pytest
from gymnasium.vector import AutoresetMode

import skate_env
from skate_env import _core
from skate_env._core import REWARD_WEIGHTS, TERMINATIONS, Scene
from skate_env.environments import PAPER_ACTIONS, TORQUE_SCALE, IceSkateEnv, IceSkateVectorEnv
from skate_env.environments.config import DEFAULTS
from skate_env.scenes import replace

ROOT = Path(__file__).parents[1]
PAGE = ROOT / "docs" / "iceskate-v0.md"
TEXT = PAGE.read_text(encoding="utf-8")
# Pages whose examples need the package only.
EXAMPLES = [
    "README.md",
    "docs/accuracy.md",
    "docs/effects.md",
    "docs/gradients.md",
    "docs/iceskate-v0.md",
    "docs/learned-policies.md",
    "docs/scenes.md",
]
# In the order of the table in docs/scenes.md.
PRESETS = ["paper", "paper_printed", "paper_arms", "push_only"]
HEADINGS = [
    "Description",
    "Action Space",
    "Observation Space",
    "Rewards",
    "Starting State",
    "Episode End",
    "Arguments",
    "Version History",
]
IDS = ["IceSkate-v0", "IceSkatePushOnly-v0", "IceSkateAnyIce-v0"]


def table(name: str, text: str = TEXT) -> list[list[str]]:
    """Cells of the named table of a page, without its head and the line below it."""
    body = text.split(f"<!-- {name} -->\n")[1].split("<!-- end -->")[0].strip()
    rows = [line.strip()[1:-1].split("|") for line in body.splitlines()]
    return [[cell.strip() for cell in row] for row in rows[2:]]


def shown(rows) -> str:
    return "\n".join(f"| {' | '.join(map(str, row))} |" for row in rows)


def check(name: str, wanted) -> None:
    """Compare a table with its expected text, which the message shows."""
    wanted = [[str(cell) for cell in row] for row in wanted]
    assert table(name) == wanted, f"table {name} of {PAGE.name} must be\n{shown(wanted)}"


def check_measured(name: str, wanted, written=None) -> None:
    """Compare a table of measured numbers, or some of its rows, to 2 % or the printed digit."""

    def same(cell: str, value) -> bool:
        if isinstance(value, str):
            return cell == value
        return float(cell) == pytest.approx(value, rel=0.02, abs=0.06 if "." in cell else 0.6)

    written = table(name) if written is None else written
    rounded = [[x if isinstance(x, str) else round(x, 1) for x in row] for row in wanted]
    assert len(written) == len(wanted) and all(
        len(cells) == len(row) and all(map(same, cells, row))
        for cells, row in zip(written, wanted, strict=True)
    ), f"table {name} must be\n{shown(rounded)}"


def bound(x: float) -> str:
    return {np.float32(np.pi): "pi", np.float32(-np.pi): "-pi"}.get(np.float32(x), f"{x:g}")


# --- form ----------------------------------------------------------------------------------------


def test_headings_are_those_of_gymnasiums_pages():
    assert re.findall(r"^## (.+)$", TEXT, re.M) == HEADINGS


@pytest.mark.parametrize("page", EXAMPLES)
def test_code_examples_run(page, tmp_path, monkeypatch):
    # One of them writes a file.
    monkeypatch.chdir(tmp_path)
    names: dict[str, object] = {}
    text = (ROOT / page).read_text(encoding="utf-8")
    blocks = re.findall(r"^```python\n(.*?)^```", text, re.M | re.S)
    assert len(blocks) >= (5 if ROOT / page == PAGE else 1)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for block in blocks:
            exec(compile(block, page, "exec"), names)


def test_texts_of_the_stub_are_those_of_the_compiled_module():
    stub = ast.parse((ROOT / "skate_env" / "_core.pyi").read_text(encoding="utf-8"))
    classes = [node for node in stub.body if isinstance(node, ast.ClassDef)]
    assert inspect.getdoc(_core) == ast.get_docstring(stub)
    for node in classes:
        made = getattr(_core, node.name)
        assert inspect.getdoc(made) == ast.get_docstring(node), node.name
        written = {}
        for member in node.body:
            # The setter of a property has the text of its getter.
            if isinstance(member, ast.FunctionDef) and not member.name.startswith("_"):
                written.setdefault(member.name, ast.get_docstring(member))
        public = {name for name in vars(made) if not name.startswith("_")}
        assert set(written) == public
        for name, text in written.items():
            assert text and inspect.getdoc(getattr(made, name)) == text, (node.name, name)


def test_every_public_class_method_and_function_has_a_text():
    modules = ("environments", "gait", "gradients", "policies", "render", "replay", "scenes", "sb3")
    for name in (f"skate_env.{module}" for module in modules):
        module = pytest.importorskip(name) if name.endswith("sb3") else import_module(name)
        own = getattr(module, "__all__", [x for x in vars(module) if not x.startswith("_")])
        for given in (getattr(module, each) for each in own):
            if not getattr(given, "__module__", "").startswith("skate_env"):
                continue
            assert inspect.getdoc(given), given
            if inspect.isclass(given):
                for member, value in vars(given).items():
                    if callable(value) and not member.startswith("_"):
                        assert inspect.getdoc(value), (given, member)


def texts_of_public_names() -> dict[str, str]:
    """Texts of the public names; constants have theirs in the stub only."""
    body = ast.parse((ROOT / "skate_env" / "_core.pyi").read_text(encoding="utf-8")).body
    constants = {
        node.target.id: text.value.value
        for node, text in pairwise(body)
        if isinstance(node, ast.AnnAssign) and isinstance(text, ast.Expr)
    }
    given = {name: getattr(skate_env, name) for name in skate_env.__all__}
    given |= {"_core.Simulator": _core.Simulator, "scenes.replace": replace}
    return {name: constants.get(name) or inspect.getdoc(x) or "" for name, x in given.items()}


@pytest.mark.parametrize(("name", "text"), texts_of_public_names().items())
def test_public_names_have_a_short_example_that_runs(name, text):
    test = doctest.DocTestParser().get_doctest(text, {}, name, None, 0)
    lines = "".join(example.source for example in test.examples).splitlines()
    assert 1 <= len(lines) <= 6
    assert doctest.DocTestRunner().run(test).failed == 0


def test_the_scene_file_is_valid():
    (text,) = re.findall(r"^```toml\n(.*?)^```", TEXT, re.M | re.S)
    ranges = Scene.from_toml('name = "some"\n' + BASE + text).get("randomise")
    assert len(ranges) == text.count("=")


# A scene file has lifting only if it has the table.
BASE = "[control.lifting]\nK_p = [300.0, 466.0, 5575.0]\nahead = 0.77\nheight = 2.0\n"


# --- tables --------------------------------------------------------------------------------------


def test_spaces():
    env = IceSkateEnv()
    (n,), (d,) = env.action_space.shape, env.observation_space.shape
    for wanted in (f"`Box(-1.0, 1.0, ({n},), float32)`", f"`Box(low, high, ({d},), float32)`"):
        assert wanted in TEXT
    assert np.isfinite([env.observation_space.low, env.observation_space.high]).all()


def test_actions():
    env = IceSkateEnv(joints="all")
    meanings = {name: meaning for name, meaning, *_ in env._batch.observation_entries()}
    axes = {body["joint"]: body["axis"] for body in env.simulator.bodies()}
    default, rows = IceSkateEnv().joint_names, []
    for joint in [*default, *(each for each in env.joint_names if each not in default)]:
        turns = meanings[f"angle.{joint}"].removeprefix(f"angle of {joint}, ")
        index = default.index(joint) if joint in default else ""
        printed = f"{PAPER_ACTIONS['action_scale'][joint]:g}"
        rows.append([index, joint, turns, axes[joint], f"{TORQUE_SCALE[joint]:g}", printed])
    check("actions", rows)


def test_observations():
    rows = []
    for i, (name, meaning, unit, low, high) in enumerate(
        IceSkateEnv()._batch.observation_entries()
    ):
        span = f"{bound(low)} to {bound(high)}"
        rows.append([str(i), f"`{name}`", meaning, span, unit])
    # Rows of one form are one row of the table. What a joint turns is in the table of actions.
    turns = {joint: what for _, joint, what, *_ in table("actions")}
    turns["q1"] = "supporting foot on the ice"
    runs = [
        (
            [f"angle.q{k}" for k in range(1, 18)],
            [f"angle of q{k}, {turns[f'q{k}']}" for k in range(1, 18)],
            "angle of the joint",
        ),
        (
            [f"rate.q{k}" for k in range(1, 18)],
            [f"rate of q{k}, {turns[f'q{k}']}" for k in range(1, 18)],
            "rate of the joint",
        ),
        (
            [f"state.{k}" for k in range(1, 21)],
            [f"1 in contact state {k} of Table 2" for k in range(1, 21)],
            "1 in that contact state of Table 2",
        ),
    ]
    for names, meanings, meaning in runs:
        first = next(i for i, row in enumerate(rows) if row[1] == f"`{names[0]}`")
        run = rows[first : first + len(names)]
        last = int(run[0][0]) + len(run) - 1
        assert [row[1:3] for row in run] == [
            [f"`{name}`", text] for name, text in zip(names, meanings, strict=True)
        ]
        assert len({tuple(row[3:]) for row in run}) == 1
        name = f"`{names[0]}` to `{names[-1]}`"
        rows[first : first + len(run)] = [[f"{run[0][0]} to {last}", name, meaning, *run[0][3:]]]
    check("observations", rows)


def test_states():
    grips = {"slide": "slides", "stick": "sticks"}
    seen = {}
    for scene in PRESETS:
        env = IceSkateEnv(scene, perturb=0.01)
        env.action_space.seed(0)
        for scale in (0.0, 0.1, 1.0):
            env.reset(seed=0)
            for _ in range(500):
                *_, terminated, _, info = env.step(scale * env.action_space.sample())
                seen[env.simulator.state_name] = info["state_number"]
                if terminated:
                    break
    assert seen.pop("air/air") == 0
    assert len(set(seen.values())) >= 10
    columns = ["stick_flat", "stick_roll", "slide_flat", "slide_roll"]
    rows = {name: numbers for name, *numbers in table("states")}
    for name, number in seen.items():
        support, free = (part.split("_") for part in name.split("/"))
        column = columns.index("_".join(support[:2]))
        if free == ["air"]:
            row = "in the air"
        else:
            grip, touch = grips[free[0]], free[1]
            row = f"{grip}, flat" if touch == "flat" else f"{grip} on heel or toe"
        assert rows[row][column] == str(number), name
    assert [int(x) for row in rows.values() for x in row] == list(range(1, 21))
    # The map from the paper to the code has the same states, each with its usual sole end.
    text = (ROOT / "docs" / "paper-map.md").read_text(encoding="utf-8")
    cells = re.findall(r"^\| (\d+) \|(?:[^|]*\|){2} `(\w+/\w+)` \|", text, re.M)
    mapped = {name: int(number) for number, name in cells}
    assert list(mapped.values()) == list(range(1, 21))
    for name, number in seen.items():
        support, free = name.split("/")
        support = support.replace("roll_heel", "roll_toe")
        assert mapped[f"{support}/{free.replace('_toe', '_heel')}"] == number, name


def test_rewards():
    terms, limits = table("rewards"), table("limits")
    written = [(row[0], row[3], row[2]) for row in terms] + [
        (row[0], row[3], row[2]) for row in limits
    ]
    wanted = [(f"`{name}`", unit, f"{default:g}") for name, unit, default in REWARD_WEIGHTS]
    assert [(name, unit.replace("^2", "2"), default) for name, unit, default in written] == wanted
    info = IceSkateEnv().reset()[1]
    keys = [key for key in info if "reward" in key]
    assert [f"reward_{row[0].strip('`')}" for row in terms] == keys


def test_infos():
    env = IceSkateEnv("push_only")
    _, info = env.reset()
    kinds = {key: [type(value)] for key, value in info.items()}
    while info["termination"] is None:
        *_, info = env.step(np.zeros(10))
        for key, value in info.items():
            if type(value) not in kinds[key]:
                kinds[key].append(type(value))
    names = {float: "float", int: "int", str: "str", type(None): "None"}
    wanted = [
        [f"`{key}`", " or ".join(sorted((names[kind] for kind in kinds[key]), reverse=True))]
        for key in info
    ]
    written = [[row[0], row[-1]] for row in table("infos")]
    # The last row stands for all terms of the reward.
    head, kind = written.pop()
    assert head == "`reward_` and a term"
    terms = [row[0].strip("`") for row in table("rewards")]
    written += [[f"`reward_{term}`", kind] for term in terms]
    assert written == wanted, shown(wanted)


def test_options():
    single, vector = IceSkateEnv(), IceSkateVectorEnv(2)
    single.reset(seed=0), vector.reset(seed=0)
    given = {
        "state": {"v": single.simulator.v},
        "params": {"ice.friction.mu_forward": 0.1},
        "phase": 1.5,
        "perturb": 0.01,
        "reset_mask": np.array([True, False]),
        "elapsed": np.array([1, 2]),
    }
    rows = {row[0].strip("`"): row[1] for row in table("options")}
    assert list(rows) == list(given)
    for option, value in given.items():
        vector.reset(options={option: value})
        if rows[option] == "both":
            single.reset(options={option: value})
        else:
            with pytest.raises(ValueError, match=option) as refused:
                single.reset(options={option: value})
    known = str(refused.value).split("must be one of ")[1].split(", ")
    assert known == [option for option, where in rows.items() if where == "both"]


def test_ends():
    assert [row[0] for row in table("ends")] == [f"`{cause}`" for cause in TERMINATIONS]


def test_autoreset_modes():
    modes = re.findall(r"^\| `([A-Z_]+)`( \(default\))? \|", TEXT, re.M)
    assert [mode for mode, _ in modes] == [mode.name for mode in AutoresetMode]
    default = inspect.signature(IceSkateVectorEnv).parameters["autoreset_mode"].default
    assert [mode for mode, mark in modes if mark] == [default.name]


def test_arguments():
    single, vector = (
        {name: x.default for name, x in inspect.signature(made).parameters.items()}
        for made in (IceSkateEnv, IceSkateVectorEnv)
    )
    for made in (single, vector):
        mode = made.pop("render_mode")
        del made["keywords"]
        made |= DEFAULTS | {"render_mode": mode}
    assert set(single) <= set(vector)
    wanted = []
    for name, default in vector.items():
        if name in single:
            assert single[name] == default
        if isinstance(default, str):
            default = f'"{default}"'
        elif isinstance(default, Enum):
            default = default.name
        wanted.append([f"`{name}`", "both" if name in single else "vector", str(default)])
    assert [row[:3] for row in table("arguments")] == wanted, shown(wanted)
    (limit,) = {gymnasium.spec(name).max_episode_steps for name in IDS}
    assert f"After {limit} actions" in TEXT


# --- measured values --------------------------------------------------------------------------


def skate(scene) -> tuple[list[str | float], dict[str, float]]:
    """Apply zero actions; return sums and the largest torques at the starts of actions."""
    env = IceSkateEnv(scene)
    _, info = env.reset(seed=0)
    sums, most = {key: 0.0 for key in info if "reward" in key}, np.zeros(16)
    actions, terminated = 0, False
    while actions < 3000 and not terminated:
        most = np.maximum(most, np.abs(env.simulator.torque[3:]))
        *_, terminated, _, info = env.step(np.zeros(10))
        sums = {key: value + info[key] for key, value in sums.items()}
        actions += 1
    end = f"`{info['termination']}`" if terminated else "time limit"
    shown_terms = [sums[f"reward_{term}"] for term in ("slide", "head", "flight", "speed")]
    row = [env.scene.name, actions, *shown_terms, sum(sums.values()), info["steps"], end]
    return row, dict(zip(TORQUE_SCALE, most, strict=True))


def test_sums_and_torques_of_zero_actions():
    played = [skate(scene) for scene in PRESETS]
    check_measured("sums", [row for row, _ in played])
    rows = [
        [joint, scale, *(most[joint] for _, most in played)]
        for joint, scale in TORQUE_SCALE.items()
    ]
    # The page says that the other joints have no torque.
    check_measured("torques", [row for row in rows if any(row[2:])])


# --- the three ids -------------------------------------------------------------------------------


def test_keywords_of_the_ids():
    rows = table("keywords")
    for column, name in enumerate(IDS, 1):
        given = {f"`{key}`": f"`{json.dumps(x)}`" for key, x in gymnasium.spec(name).kwargs.items()}
        assert {row[0]: row[column] for row in rows if row[column]} == given, name


def test_starts_are_as_fast_as_the_page_says():
    sims = [skate_env.Simulator(scene) for scene in PRESETS]
    slowest, fastest = re.search(r"\(([\d.]+) to ([\d.]+) m/s by preset\)", TEXT).groups()
    speeds = [sim.v[0] for sim in sims]
    assert [min(speeds), max(speeds)] == pytest.approx([float(slowest), float(fastest)], abs=0.05)
    np.testing.assert_allclose([sim.gaps()[0] for sim in sims], 0.0, atol=1e-12)
    assert {sim.state_name for sim in sims} == {"slide_flat/air"}
    lowest = {sim.scene.get("fall.head_height") for sim in sims}
    assert lowest == {1.0}
