"""Hard cases: every case with every method it supports, and the command that runs them."""

import csv
import json
import math
from collections import Counter
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner, Result

from skate_env.cli import app
from skate_env.studies.hardcases import catalogue, chart, report, runner
from skate_env.studies.hardcases.case import METHODS, CaseContext, Unexpected
from skate_env.studies.hardcases.catalogue import CASES

CLAIMS = [(name, method) for name, case in CASES.items() for method in case.limits]
# These runs take seconds each; the quick tier has the same cases at `balanced`.
LONG = {
    ("violent_torques", "rosenbrock"): "torques of 1e6 N m with a linearly implicit method",
    **{
        (name, "reference"): "a hundred steps at `reference`, or torques of 1e6 N m"
        for name in CASES
        if name.startswith(("energy_of_", "drift_of_")) or name == "violent_torques"
    },
}


def claim(name: str, method: str) -> Any:
    reason = LONG.get((name, method))
    marks = [pytest.mark.long(reason)] if reason else []
    return pytest.param(name, method, marks=marks, id=f"{name}-{method}")


# It takes milliseconds, and `fast` does not support it.
QUICK = "grazing"


@cache
def measured(name: str, method: str) -> runner.Result:
    return runner.measure(CASES[name], method)


def run(*arguments: object) -> Result:
    return CliRunner().invoke(app, ["hardcases", *map(str, arguments)])


def last_line(result: Result) -> dict[str, Any]:
    def refuse(constant: str) -> None:
        raise AssertionError(f"{constant} is not JSON")

    said: dict[str, Any] = json.loads(result.stdout.splitlines()[-1], parse_constant=refuse)
    return said


def changed(monkeypatch: pytest.MonkeyPatch, **changes: Any) -> None:
    monkeypatch.setitem(CASES, QUICK, replace(CASES[QUICK], **changes))


@pytest.mark.parametrize(("name", "method"), [claim(*each) for each in CLAIMS])
def test_case_keeps_its_limit(name: str, method: str) -> None:
    result = runner.measure(CASES[name], method)
    assert result.passed, f"{result.reason or result.measured}, limit {result.limit}"
    if method == next(iter(CASES[name].limits)):
        assert runner.measure(CASES[name], method) == result, "another number the second time"


def test_there_are_forty_cases_with_unique_names() -> None:
    names = Counter(case.name for group in catalogue._GROUPS for case in group.GROUP.cases)
    assert names.total() == len(names) == len(CASES) >= 40


def test_every_case_has_a_description() -> None:
    for case in CASES.values():
        for part in ("kind", "setup", "naive", "law", "criterion"):
            assert getattr(case, part).strip(), f"{case.name}: {part}"
        assert set(case.limits) <= set(METHODS), case.name
        for method, limit in case.limits.items():
            assert math.isfinite(limit) and limit >= 0.0, f"{case.name}, {method}"
        assert case.excluded or set(case.limits) == set(METHODS), case.name


def test_documentation_holds_every_case() -> None:
    """`make hardcases` updates it."""
    docs = Path(__file__).parents[1] / "docs"
    page = (docs / "generated" / "hard-cases.md").read_text(encoding="utf-8")
    for name in CASES:
        assert f"#### `{name}`" in page, name
    assert "FAILED" not in page


# --- failures --------------------------------------------------------------------------------


def fails(monkeypatch: pytest.MonkeyPatch, outcome: float | BaseException) -> runner.Result:
    def measure(context: CaseContext) -> float:
        if isinstance(outcome, BaseException):
            raise outcome
        return outcome

    changed(monkeypatch, measure=measure)
    result = runner.measure(CASES[QUICK], "balanced")
    assert not result.passed
    return result


PANIC = type("PanicException", (BaseException,), {})


@pytest.mark.parametrize(
    ("outcome", "said"),
    [
        (Unexpected("nothing lands"), "nothing lands"),
        (ValueError("no such foot"), "ValueError: no such foot"),
        (PANIC("index out of bounds"), "PanicException: index out of bounds"),
        (math.nan, "measured nan"),
        (math.inf, "measured inf"),
        (-1e-3, "measured -0.001"),
    ],
    ids=str,
)
def test_a_case_without_a_result_fails_with_its_reason(
    monkeypatch: pytest.MonkeyPatch, outcome: float | BaseException, said: str
) -> None:
    result = fails(monkeypatch, outcome)
    assert (result.measured, result.margin, result.exact) == (None, None, False)
    assert result.reason == said


def test_limit_of_zero_is_kept_by_zero_only(monkeypatch: pytest.MonkeyPatch) -> None:
    exact = measured(QUICK, "balanced")
    assert exact.passed and exact.exact and exact.margin is None
    result = fails(monkeypatch, 1e-300)
    assert result.limit == result.margin == 0.0 and not result.exact


def test_an_interruption_is_no_failure(monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(KeyboardInterrupt):
        fails(monkeypatch, KeyboardInterrupt())


def test_nominal_case_costs_one() -> None:
    context = CaseContext("fast")
    context.simulator("paper_printed").advance(2.0)
    assert context.cost() == runner.nominal("fast") > 0.0


# --- command ---------------------------------------------------------------------------------


def test_list_names_every_case_and_runs_none() -> None:
    result = run("--list")
    assert result.exit_code == 0
    lines = result.stdout.splitlines()
    for case in CASES.values():
        assert f"  {case.name}" in lines and f"{case.kind}:" in lines
        assert case.setup in " ".join(result.stdout.split())


@pytest.mark.parametrize("option", ["--case", "--method"])
def test_unknown_name_is_refused_with_the_known_ones(option: str) -> None:
    result = run(option, "papier")
    assert result.exit_code == 2
    assert result.stderr.startswith("error: ") and "papier" in result.stderr
    for name in CASES if option == "--case" else METHODS:
        assert name in result.stderr
    assert "Traceback" not in result.output


def test_an_empty_selection_is_reported_with_its_reason() -> None:
    result = run("--case", QUICK, "--method", "fast")
    assert result.exit_code == 2 and CASES[QUICK].excluded in result.stderr


def test_json_agrees_with_the_table() -> None:
    result = run("--case", "painleve_heel", "--case", QUICK, "--method", "all", "--json")
    assert result.exit_code == 0, result.output
    said = last_line(result)
    assert said["passed"] and not said["failures"]
    assert said["methods"] == list(METHODS) == list(said["nominal_evaluations_per_second"])
    reason = CASES[QUICK].excluded
    assert said["not_claimed"] == [{"case": QUICK, "method": "fast", "reason": reason}]
    assert len(said["results"]) == 2 * len(METHODS) - 1
    for row in said["results"]:
        assert row["exact"] == (row["measured"] == 0.0) == (row["margin"] is None)
        again = measured(row["case"], row["method"])
        assert (row["measured"], row["cost_ratio"]) == (again.measured, again.cost)
    table = result.stdout.splitlines()[:-1]
    assert all(len(line) <= 120 for line in table)
    assert f"fast does not support 1 of 2 cases: {reason} ({QUICK})." in table


def test_named_accuracies_are_run_unless_others_are_asked_for() -> None:
    said = last_line(run("--case", "painleve_heel", "--json"))
    assert [row["method"] for row in said["results"]] == list(runner.NAMED)
    said = last_line(run("--case", QUICK, "--method", "rk4", "--method", "balanced", "--json"))
    assert said["methods"] == ["balanced", "rk4"]


def test_failing_case_fails_the_command(monkeypatch: pytest.MonkeyPatch) -> None:
    changed(monkeypatch, measure=lambda context: 3.0)
    result = run("--case", QUICK, "--method", "balanced", "--json")
    assert result.exit_code == 1
    assert f"FAILED: {QUICK} at balanced: measured 3, more than 0" in result.stdout
    said = last_line(result)
    assert said["failures"] == [f"{QUICK}-balanced"] and not said["passed"]


def test_folder_holds_table_picture_and_fragment(tmp_path: Path) -> None:
    out = tmp_path / "new" / "folder"
    result = run("--case", QUICK, "--case", "painleve_heel", "--out", out, "--json")
    assert result.exit_code == 0, result.output
    names = {"hard-cases.csv", "hard-cases.md", "hard-cases.png"}
    assert {path.name for path in out.iterdir()} == names
    assert (out / "hard-cases.png").read_bytes().startswith(b"\x89PNG")
    with (out / "hard-cases.csv").open(newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    said = last_line(result)["results"]
    assert [row["case"] for row in rows] == [row["case"] for row in said]
    assert [float(row["measured"]) for row in rows] == [row["measured"] for row in said]
    fragment = (out / "hard-cases.md").read_text(encoding="utf-8")
    assert f"skate-env hardcases --case {QUICK} --case painleve_heel" in fragment
    assert f"Not supported by `fast`: {CASES[QUICK].excluded}." in fragment
    for name in (QUICK, "painleve_heel"):
        for words in (CASES[name].setup, CASES[name].naive, CASES[name].law):
            assert words in fragment


def test_picture_and_text_show_failures_without_a_number(monkeypatch: pytest.MonkeyPatch) -> None:
    lost = fails(monkeypatch, PANIC("lost"))
    made = runner.Run([lost.case], ["balanced"], [lost])
    assert "FAILED: grazing at balanced: PanicException: lost" in report.text(made)
    assert "**FAILED** at `balanced`: PanicException: lost" in report.markdown(made, "")
    (ax,) = chart.figure(made).axes
    assert "fails,\nno margin" in [label.get_text() for label in ax.get_xticklabels()]


def test_help_shows_examples() -> None:
    result = run("--help")
    assert result.exit_code == 0
    assert result.stdout.count("\n    skate-env hardcases") >= 3
