"""The documents agree with the code: IceSkate-v0, states of the paper, links, examples."""

import inspect
import json
import re
import warnings
from enum import Enum
from pathlib import Path

import gymnasium
import numpy as np
import pytest
from gymnasium.vector import AutoresetMode

import skate_env
from skate_env import baseline
from skate_env._core import TERMINATIONS, Scene
from skate_env.env import IceSkateEnv
from skate_env.env_config import TORQUE_SCALE
from skate_env.vector import IceSkateVectorEnv

ROOT = Path(__file__).parents[1]
PAGE = ROOT / "docs" / "iceskate-v0.md"
TEXT = PAGE.read_text(encoding="utf-8")
DOCUMENTS = [*ROOT.glob("*.md"), *(ROOT / "docs").rglob("*.md"), ROOT / "training" / "README.md"]
# Most lines of a page.
LONGEST = {"README.md": 100, "docs/hard-cases.md": 150, "docs/performance.md": 150}
# Pages whose examples need nothing but the package.
EXAMPLES = [
    "README.md",
    "docs/accuracy.md",
    "docs/effects.md",
    "docs/iceskate-v0.md",
    "docs/learned-policies.md",
    "docs/scenes.md",
]
# In the order of the table in docs/scenes.md.
PRESETS = ["paper", "paper_damped", "paper_arms", "blade", "unilateral"]
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
SOURCES = {
    "q2": "largest amplitude of tau2, Eq. 17",
    "q3": "amplitude of tau3, Eq. 18",
    "q4": "none printed: as the free hip",
    "q5": "largest amplitude of tau5, Eq. 19",
    "q6": "tau6, Eq. 20",
    "q7": "largest tau7, Eq. 21",
    "q8": "amplitude of tau8, Eq. 22",
    "q9": "none printed: as the yaw",
    "q10": "none printed: as the yaw",
    **dict.fromkeys(["q11", "q12", "q13", "q14", "q15", "q16"], "none printed: moves a light arm"),
    "q17": "none printed: moves the head",
}


def table(name: str) -> list[list[str]]:
    """Cells of the page's table of that name, without its head and the line below that."""
    body = TEXT.split(f"<!-- {name} -->\n")[1].split("<!-- end -->")[0].strip()
    rows = [line.strip()[1:-1].split("|") for line in body.splitlines()]
    return [[cell.strip() for cell in row] for row in rows[2:]]


def shown(rows) -> str:
    return "\n".join(f"| {' | '.join(map(str, row))} |" for row in rows)


def check(name: str, wanted) -> None:
    """Compare a table with what it must be; the message shows that."""
    wanted = [[str(cell) for cell in row] for row in wanted]
    assert table(name) == wanted, f"table {name} of {PAGE.name} must be\n{shown(wanted)}"


def check_measured(name: str, wanted) -> None:
    """Compare a table of measured numbers, to 2 % or the printed digit."""

    def same(cell: str, value) -> bool:
        if isinstance(value, str):
            return cell == value
        return float(cell) == pytest.approx(value, rel=0.02, abs=0.06 if "." in cell else 0.6)

    written = table(name)
    rounded = [[x if isinstance(x, str) else round(x, 1) for x in row] for row in wanted]
    assert len(written) == len(wanted) and all(
        len(cells) == len(row) and all(map(same, cells, row))
        for cells, row in zip(written, wanted, strict=True)
    ), f"table {name} of {PAGE.name} must be\n{shown(rounded)}"


def bound(x: float) -> str:
    return {np.float32(np.pi): "pi", np.float32(-np.pi): "-pi"}.get(np.float32(x), f"{x:g}")


# --- form ----------------------------------------------------------------------------------------


def test_headings_are_those_of_gymnasiums_pages():
    assert re.findall(r"^## (.+)$", TEXT, re.M) == HEADINGS


def anchors(page: Path) -> list[str]:
    """Anchors of a page's headings, as GitHub makes them."""
    titles = re.findall(r"^#+ (.+)$", page.read_text(encoding="utf-8"), re.M)
    return [re.sub(r"[^\w\- ]", "", title.lower()).replace(" ", "-") for title in titles]


@pytest.mark.parametrize("page", DOCUMENTS, ids=lambda page: str(page.relative_to(ROOT)))
def test_links_and_pictures_exist(page):
    links = re.findall(r"\]\(([^)\s]+)\)", page.read_text(encoding="utf-8"))
    assert page != PAGE or ("iceskate.png" in links and len(links) > 10)
    for link in links:
        if link.startswith("https://"):
            continue
        file, _, heading = link.partition("#")
        target = page.parent / file if file else page
        assert target.exists(), link
        assert not heading or heading in anchors(target), link


def test_index_lists_every_document():
    index = ROOT / "docs" / "README.md"
    links = re.findall(r"\]\(([^)\s]+)\)", index.read_text(encoding="utf-8"))
    listed = {(index.parent / link).resolve() for link in links}
    assert set(DOCUMENTS) <= listed | {index}


@pytest.mark.parametrize("page", LONGEST)
def test_pages_are_short(page):
    assert len((ROOT / page).read_text(encoding="utf-8").splitlines()) <= LONGEST[page]


@pytest.mark.parametrize("page", EXAMPLES)
def test_code_runs_as_it_stands(page):
    names: dict[str, object] = {}
    text = (ROOT / page).read_text(encoding="utf-8")
    blocks = re.findall(r"^```python\n(.*?)^```", text, re.M | re.S)
    assert len(blocks) >= (5 if ROOT / page == PAGE else 1)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for block in blocks:
            exec(compile(block, page, "exec"), names)


def test_scene_file_is_one():
    (text,) = re.findall(r"^```toml\n(.*?)^```", TEXT, re.M | re.S)
    ranges = json.loads(Scene.from_toml('name = "some"\n' + BASE + text).to_json())["randomise"]
    assert len(ranges) == text.count("=")


# A scene's file has lifting only if it says so.
BASE = "[control.lifting]\nK_p = [300.0, 466.0, 5575.0]\nahead = 0.77\nheight = 2.0\n"


# --- tables --------------------------------------------------------------------------------------


def test_spaces():
    env = IceSkateEnv()
    (n,), (d,) = env.action_space.shape, env.observation_space.shape
    for wanted in (f"`Box(-1.0, 1.0, ({n},), float32)`", f"`Box(low, high, ({d},), float32)`"):
        assert wanted in TEXT
    assert np.isfinite([env.observation_space.low, env.observation_space.high]).all()


def test_actions():
    env = IceSkateEnv()
    meanings = {name: meaning for name, meaning, *_ in env._batch.observation_entries()}
    axes = {body["joint"]: body["axis"] for body in env.simulator.bodies()}
    rows = []
    for i, joint in enumerate(env.joint_names):
        turns = meanings[f"angle.{joint}"].removeprefix(f"angle of {joint}, ")
        rows.append([i, joint, turns, axes[joint], f"{TORQUE_SCALE[joint]:g}", SOURCES[joint]])
    check("actions", rows)


def test_observations():
    rows = []
    for i, (name, meaning, unit, low, high) in enumerate(
        IceSkateEnv()._batch.observation_entries()
    ):
        span = f"{bound(low)} to {bound(high)}"
        rows.append([str(i), f"`{name}`", meaning, span, unit])
    # States 1 to 20 are alike.
    first = next(i for i, row in enumerate(rows) if row[1] == "`state.1`")
    states = rows[first : first + 20]
    for k, row in enumerate(states, 1):
        assert row[1:] == [f"`state.{k}`", f"1 in contact state {k} of Table 2", "0 to 1", "1"]
    index, name = f"{first} to {first + 19}", "`state.1` to `state.20`"
    run = [index, name, "1 in that contact state of Table 2", "0 to 1", "1"]
    check("observations", [*rows[:first], run, *rows[first + 20 :]])


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
    # The map from the paper to the code names the same states, each end of a sole by the usual one.
    text = (ROOT / "docs" / "paper-map.md").read_text(encoding="utf-8")
    cells = re.findall(r"^\| (\d+) \|(?:[^|]*\|){5} `(\w+/\w+)` \|", text, re.M)
    mapped = {name: int(number) for number, name in cells}
    assert list(mapped.values()) == list(range(1, 21))
    for name, number in seen.items():
        support, free = name.split("/")
        support = support.replace("roll_heel", "roll_toe")
        assert mapped[f"{support}/{free.replace('_toe', '_heel')}"] == number, name


def test_rewards():
    keywords = inspect.signature(IceSkateEnv).parameters
    info = IceSkateEnv().reset()[1]
    rows = table("rewards")
    assert [f"`reward_{row[0]}`" for row in rows] == [row[5] for row in rows]
    assert [row[5].strip("`") for row in rows] == [key for key in info if "reward" in key]
    for term, _, weight, unit, default, _ in rows:
        assert weight == f"`{term}_weight`"
        assert float(default) == keywords[f"{term}_weight"].default
        assert unit == {"slide": "1/m"}.get(term, "1/s")


def test_infos():
    env = IceSkateEnv("unilateral")
    _, info = env.reset()
    kinds = {key: [type(value)] for key, value in info.items()}
    while info["termination"] is None:
        *_, info = env.step(np.zeros(16))
        for key, value in info.items():
            if type(value) not in kinds[key]:
                kinds[key].append(type(value))
    names = {float: "float", int: "int", str: "str", type(None): "None"}
    wanted = [
        [f"`{key}`", " or ".join(sorted((names[kind] for kind in kinds[key]), reverse=True))]
        for key in info
    ]
    assert [[row[0], row[-1]] for row in table("infos")] == wanted, shown(wanted)


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
    single, vector = (inspect.signature(x).parameters for x in (IceSkateEnv, IceSkateVectorEnv))
    assert set(single) <= set(vector)
    wanted = []
    for name, parameter in vector.items():
        default = parameter.default
        if name in single:
            assert single[name].default == default
        if isinstance(default, str):
            default = f'"{default}"'
        elif isinstance(default, Enum):
            default = default.name
        wanted.append([f"`{name}`", "both" if name in single else "vector", str(default)])
    assert [row[:3] for row in table("arguments")] == wanted, shown(wanted)
    limit = gymnasium.spec("IceSkate-v0").max_episode_steps
    assert vector["max_episode_steps"].default == limit
    assert f"After {limit} actions" in TEXT


# --- what was measured ---------------------------------------------------------------------------


def skate(scene) -> tuple[list[str | float], dict[str, float]]:
    """Play zero actions; a row of sums, and the largest torques at the beginnings of actions."""
    env = IceSkateEnv(scene)
    env.reset(seed=0)
    sums, most = np.zeros(3), np.zeros(16)
    actions, terminated = 0, False
    while actions < 3000 and not terminated:
        most = np.maximum(most, np.abs(env.simulator.torque[3:]))
        *_, terminated, _, info = env.step(np.zeros(16))
        sums += [info["reward_slide"], info["reward_head"], info["reward_effort"]]
        actions += 1
    end = f"`{info['termination']}`" if terminated else "time limit"
    row = [env.scene.name, actions, *sums, sums.sum(), info["steps"], end]
    return row, dict(zip(env.joint_names, most, strict=True))


def test_sums_and_torques_of_zero_actions():
    played = [skate(scene) for scene in PRESETS]
    check_measured("sums", [row for row, _ in played])
    check_measured(
        "torques",
        [
            [joint, scale, *(most[joint] for _, most in played)]
            for joint, scale in TORQUE_SCALE.items()
        ],
    )


def test_sums_of_lifting_only():
    scenes = [baseline.lifting_only(scene).scene for scene in PRESETS]
    check_measured("lifting", [skate(scene)[0] for scene in scenes])


def test_slide_of_a_scaled_feedforward():
    scene, factor, slide = re.search(
        r'scaled_feedforward\("(\w+)", ([\d.]+)\)`\) slide ([\d.]+) m', TEXT
    ).groups()
    row, _ = skate(baseline.scaled_feedforward(scene, float(factor)).scene)
    assert row[2] == pytest.approx(float(slide), abs=0.06)


def test_starts_are_as_fast_as_the_page_says():
    sims = [skate_env.Simulator(scene) for scene in PRESETS]
    slowest, fastest = re.search(r"\(([\d.]+) to ([\d.]+) m/s by preset\)", TEXT).groups()
    speeds = [sim.v[0] for sim in sims]
    assert [min(speeds), max(speeds)] == pytest.approx([float(slowest), float(fastest)], abs=0.05)
    np.testing.assert_allclose([sim.gaps()[0] for sim in sims], 0.0, atol=1e-12)
    assert {sim.state_name for sim in sims if sim.scene.name != "blade"} == {"slide_flat/air"}
    lowest = {json.loads(sim.scene.to_json())["fall"]["head_height"] for sim in sims}
    assert lowest == {1.0}
