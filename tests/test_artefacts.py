"""The plan that makes everything again covers what is in the repository."""

import subprocess
from pathlib import Path

from typer.testing import CliRunner

from training import artefacts
from training.artefacts import ARTEFACTS, ROOT

MADE = (
    *("docs/*.png", "docs/*.gif", "docs/*.ipynb", "docs/*.txt", "docs/generated/*", "*.npz"),
    "training/benchmark/results/*",
)
# Screenshots, which a person chooses.
BY_HAND = {"docs/browser.png", "docs/player.png"}
# Solutions from which searches start, and policies of earlier trainings: no command repeats them.
NOT_AGAIN = {
    "training/benchmark/push_only_seed_1.npz",
    "training/imitation/policies/push_only_order.npz",
    "training/orbits/push_only_all.npz",
    "training/trajectory/push_only_step.npz",
}


def tracked(*patterns: str) -> set[str]:
    command = ["git", "ls-files", "--", *patterns]
    return set(subprocess.run(command, cwd=ROOT, capture_output=True, text=True).stdout.split())


def test_everything_that_a_program_makes_is_in_the_plan():
    files = [pattern for made in ARTEFACTS.values() for pattern in made.files]
    assert tracked(*MADE) - tracked(*files) == BY_HAND | NOT_AGAIN


def test_every_pattern_has_a_file():
    for made in ARTEFACTS.values():
        for pattern in made.files:
            assert list(ROOT.glob(pattern)), pattern


def test_an_interrupted_plan_goes_on(tmp_path, monkeypatch):
    monkeypatch.setattr(artefacts, "ROOT", tmp_path)
    plan = {
        name: artefacts.Artefact(1, (name,), (f"echo {name} >> made",)) for name in ("a", "b", "c")
    }
    plan["b"] = artefacts.Artefact(1, ("b",), ("test -e ready && echo b >> made",))
    monkeypatch.setattr(artefacts, "ARTEFACTS", plan)
    command = artefacts.app
    run = CliRunner().invoke
    assert "3 min of" in run(command, ["--plan"]).output and not Path(tmp_path / "made").exists()
    assert run(command, []).exit_code == 1
    assert (tmp_path / "made").read_text() == "a\n"
    (tmp_path / "ready").touch()
    assert run(command, []).exit_code == 0
    assert (tmp_path / "made").read_text() == "a\nb\nc\n"
    assert run(command, ["b"]).exit_code == 0 and run(command, []).exit_code == 0
    assert (tmp_path / "made").read_text() == "a\nb\nc\nb\n"
    assert run(command, ["d"]).exit_code == 2
