"""The command that searches for gaits."""

import json
import re
from itertools import pairwise
from pathlib import Path

import pytest

import training.gaits

pytest.importorskip("cma", reason="pip install 'skate-env[identify]'")

from typer.testing import CliRunner

from skate_env import Simulator, load_scene, scene_names
from skate_env.gait import ORDER, StepOrder
from skate_env.replay import TAU8
from skate_env.scenes import replace
from training.gaits.evolution import Objective, Stage
from training.gaits.limits import HUMAN, REQUIRED, Limit
from training.gaits.scene_file import settled, toml_of
from training.gaits.score import ARMS, TERMS, arms, distance, run, score, similarity, terms
from training.gaits.search import app, start_of
from training.gaits.variables import variables

ONE_RUN = Stage(1, 0.0, range(1))


def identify(out, *arguments):
    asked = ["--out", out, "--budget", 3, "--steps", 2, "--episodes", 2, *arguments]
    return CliRunner().invoke(app, [str(argument) for argument in asked])


def test_search_writes_a_scene_that_skates_and_says_how_it_was_found(tmp_path):
    out = tmp_path / "new" / "found.toml"
    result = identify(out, "--spread", 0.001)
    assert result.exit_code == 0, result.output
    scene = load_scene(out)
    assert scene.name == "found" and Simulator(scene).termination is None
    fields = json.loads(scene.to_json())
    assert "\n" not in fields["provenance"]
    for said in ("--seed 0", "--budget 3", "candidates", "score 0."):
        assert said in fields["provenance"]
    # The paper's start completes its steps, and the result is not worse.
    assert score(run(scene, 2, 0.0, 0), {}, human=False) < 1.0


@pytest.mark.long("a search is reproducible")
def test_same_seed_writes_the_same_file_with_any_number_of_workers(tmp_path):
    out = tmp_path / "found.toml"
    texts = []
    for more in (("--workers", 1), ("--workers", 2), ("--seed", 1)):
        assert identify(out, "--arms", "--freeze", "foot", *more).exit_code == 0
        texts.append(out.read_text(encoding="utf-8"))
    assert texts[0] == texts[1] != texts[2]


@pytest.mark.parametrize("name", scene_names())
def test_scene_survives_being_written_without_its_defaults(name):
    scene = load_scene(name)
    assert type(scene).from_toml(toml_of(scene)).to_json() == scene.to_json()


def test_candidate_of_no_move_is_the_scene_and_every_variable_moves_it():
    scene = load_scene("paper")
    moves = variables(scene, [])
    objective = Objective(scene.to_json(), moves, 3, {}, human=False)
    still = [0.0] * len(moves)
    own = score(run(scene, 3, 0.0, 0), {}, human=False)
    assert objective(still, ONE_RUN) == pytest.approx(own, rel=1e-3)
    told = {
        objective.scene_at([float(i == j) for i in range(len(moves))]).to_json()
        for j in range(len(moves))
    }
    assert len(told) == len(moves)


def test_impossible_start_has_the_worst_score_and_is_no_error():
    below = replace(load_scene("paper"), {"start.q.q6": 0.0, "start.q.q7": 1.0})
    assert Objective(below.to_json(), [], 5, {}, human=False)([], ONE_RUN) == 5.0


def test_every_missing_step_costs_more_than_all_terms():
    """The score of N steps less k lies from k to k + 1."""
    falls = replace(load_scene("paper"), {"fall.head_height": 2.9})
    assert 4.0 < score(run(falls, 5, 0.0, 0), {}, human=False) <= 5.0
    assert 0.0 < score(run(load_scene("paper"), 5, 0.0, 0), {}, human=False) < 1.0


def test_score_is_0_exactly_where_the_terms_are_met():
    """With the weights of all unmet terms at 0; and a weight only ever adds."""
    motion = run(load_scene("paper"), 4, 0.0, 0)
    unmet = {name for name, far in terms(motion, human=True).items() if far > 0.0}
    assert unmet and unmet < set(TERMS)
    assert score(motion, dict.fromkeys(unmet, 0.0), human=True) == 0.0
    scores = [score(motion, dict.fromkeys(unmet, w), human=True) for w in (0.0, 0.5, 1.0, 2.0)]
    assert all(a < b for a, b in pairwise(scores))


def test_terms_ask_for_no_less_than_the_card():
    """A term of the same name as a line of the card lies within its limits."""
    for name, term in TERMS.items():
        for limits, asked in ((REQUIRED, term.required), (HUMAN, term.human)):
            if asked is not None and name in limits:
                card = limits[name]
                assert card.at_least <= asked.at_least and asked.at_most <= card.at_most, name


@pytest.mark.parametrize(
    ("states", "wanted"),
    [(ORDER, 1.0), ((), 0.0), ((3, 15, 14), 0.75), ((0,), 0.0), ((3, 7, 5, 15, 16, 14), 10 / 11)],
)
def test_similarity_counts_the_longest_common_subsequence(states, wanted):
    step = StepOrder(tuple((state, 0.1) for state in states))
    assert similarity(step) == pytest.approx(wanted)


def test_distance_is_0_within_the_limits():
    assert distance(0.25, Limit(0.22, 0.28)) == 0.0
    assert distance(0.2, Limit(0.22, 0.28)) == pytest.approx(0.02)
    assert distance(3.0, Limit(at_most=2.0)) == 1.0


def test_settled_scene_goes_on_with_the_same_gait():
    """The step after the cut has the same states; the cut is at a swap."""
    scene = load_scene("paper")
    cut = settled(scene, 2)
    states = [order.sequence() for order in run(cut, 3, 0.0, 0).orders]
    assert states == [order.sequence() for order in run(scene, 5, 0.0, 0).orders[2:]]
    with pytest.raises(ValueError, match="too early for --settle"):
        settled(replace(scene, {"fall.head_height": 2.9}), 2)


def test_paper_starts_where_its_command_starts():
    """The search held the start, twenty steps of the file that the preset's provenance names."""
    fields = json.loads(load_scene("paper").to_json())
    asked = dict(re.findall(r"--(\w+) (\S+)", fields["provenance"]))
    assert "--freeze start" in fields["provenance"]
    start = start_of(str(Path(__file__).parents[1] / asked["scene"]), int(asked["settle"]), False)
    cut = start.get("start")
    assert cut.keys() == fields["start"].keys() and cut["support_leg"] == "right"
    for numbers in ("q", "v"):
        # Measured: all six digits.
        assert fields["start"][numbers] == pytest.approx(cut[numbers], abs=1e-4)


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["--scene", "papier"], "papier"),
        (
            [
                "--freeze",
                "lifting",
                "--freeze",
                "foot",
                "--freeze",
                "stabilizers",
                "--freeze",
                "start",
            ],
            "freeze",
        ),
        (["--weight", "pull=2"], "largest_pull"),
        (["--weight", "sole=many"], "'many'"),
        (["--weight", "sole=-1"], "between 0 and 1e6"),
        (["--weight", "sole"], "''"),
    ],
)
def test_mistake_is_one_clear_line_and_exit_code_2(tmp_path, arguments, said):
    result = identify(tmp_path / "found.toml", *arguments)
    assert result.exit_code == 2
    assert result.stderr.startswith("error: ") and said in result.stderr


def test_terms_are_those_of_the_page():
    page = Path(training.gaits.__file__).with_name("README.md").read_text(encoding="utf-8")
    rows = re.findall(r"^\| `(\w+)`.* \| ([\d.]+)[^|]* \| ([\d.]+) \|$", page, re.MULTILINE)
    terms = TERMS | {"arms": ARMS}
    assert rows == [(name, f"{term.unit:g}", f"{term.weight:g}") for name, term in terms.items()]


def test_the_term_of_the_arms_sees_their_swing():
    with_tau8 = replace(load_scene("paper_arms"), TAU8)
    # Measured -0.74, as in the recording of a replay; without tau8 both arms swing alike, 1.000.
    assert terms(run(with_tau8, 100, 0.0, 0), False)["arms"] < 0.5
    assert arms(run(load_scene("paper_arms"), 20, 0.0, 0)) > 0.99
    # Locked.
    assert arms(run(load_scene("paper_arms").without("arms"), 3, 0.0, 0)) == 1.0
