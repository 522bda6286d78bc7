"""The command that searches for gaits."""

import json

import pytest

pytest.importorskip("cma", reason="pip install 'skate-env[identify]'")

from typer.testing import CliRunner

from skate_env import Simulator, load_scene, scene_names
from skate_env.scenes import replace
from training.identify import Objective, app, score, toml_of, variables


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
    for said in ("--seed 0", "--budget 3", "evaluations", "score 0."):
        assert said in fields["provenance"]
    # The paper's start completes its steps, and the result is not worse.
    assert score(scene, 2, 0.0, 0) < 1.0


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
    objective = Objective(scene.to_json(), moves, 3, arms=False)
    still = [0.0] * len(moves)
    assert objective(still, 0.0, range(1)) == pytest.approx(score(scene, 3, 0.0, 0), rel=1e-3)
    told = {
        objective.scene_at([float(i == j) for i in range(len(moves))]).to_json() for j in range(5)
    }
    assert len(told) == 5


def test_impossible_start_has_the_worst_score_and_is_no_error():
    below = replace(load_scene("paper"), {"start.q.q6": 0.0, "start.q.q7": 1.0})
    assert score(below, 5, 0.0, 0) == 6.0


def test_fall_counts_the_steps_before_it():
    falls = replace(load_scene("paper"), {"fall.head_height": 2.9})
    assert 5.0 < score(falls, 5, 0.0, 0) <= 6.0


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
    ],
)
def test_mistake_is_one_clear_line_and_exit_code_2(tmp_path, arguments, said):
    result = identify(tmp_path / "found.toml", *arguments)
    assert result.exit_code == 2
    assert result.stderr.startswith("error: ") and said in result.stderr
