"""The work-precision study: its results, not its timings."""

import csv
import io
import json
import sys
from dataclasses import replace
from importlib import import_module

import numpy as np
import pytest
from typer.testing import CliRunner

from skate_env.cli import app
from skate_env.studies.accuracy import independent, prices, records, study
from skate_env.studies.accuracy.outcome import Errors, Outcome, errors, failure, root_mean_square
from skate_env.studies.accuracy.reference import Reference
from skate_env.studies.accuracy.settings import NAMED, Setting, StudySize, dopri5, settings
from skate_env.studies.motions.cases import cases

TOLERANCES = (1e-3, 1e-5, 1e-7)
TINY = StudySize(
    starts=2,
    settings=(
        *map(dopri5, TOLERANCES),
        Setting("rk4", "4 ms", 4e-3, {"method": "rk4", "step": 4e-3}, True),
    ),
    thin=True,
    solvers=(("DOP853", 1),),
    rounds=2,
    steps=1,
)


@pytest.fixture(scope="module")
def tiny() -> study.Study:
    with pytest.MonkeyPatch.context() as patch:
        patch.setitem(sys.modules, "mujoco", None)
        return study.make(["swing", "slide", "landing"], TINY)


def rows(made: study.Study, case: str, method: str) -> list[study.Row]:
    (found,) = (each for each in made.cases if each.name == case)
    return [row for row in found.rows if (row.tool, row.method) == (study.ENGINE, method)]


def outcome(**changes: object) -> Outcome:
    plain = Outcome(
        *(1.0, None, np.zeros(3), np.zeros(3), (3, 7), (0.5,), 0.1),
        *(1e-9, 0.0, None, None, None, {}),
    )
    return replace(plain, **changes)


def test_error_falls_with_the_tolerance(tiny: study.Study) -> None:
    for case in ("slide", "landing"):
        errors_ = [row.errors.position for row in rows(tiny, case, "dopri5")]
        assert None not in errors_
        coarse, middle, fine = (error or 0.0 for error in errors_)
        assert coarse > 10.0 * middle > 100.0 * fine > 0.0, case


def test_rk4_fails_at_4_ms_and_has_no_errors(tiny: study.Study) -> None:
    """The damping of Table 1 makes it unstable above about 2 ms."""
    (row,) = rows(tiny, "swing", "rk4")
    assert row.failures == 1 and row.failure is not None
    assert row.errors == Errors() and not any(row.trusted.values())


def test_references_agree(tiny: study.Study) -> None:
    pytest.importorskip("scipy")
    for case in tiny.cases:
        (check,) = case.reference.cross_checks
        assert check.failures == (), case.name
        difference = check.difference
        assert difference.position is not None and difference.position < 1e-8, case.name
        assert case.smooth or (difference.event_time or 0.0) < 1e-8, case.name


def test_reference_has_the_closed_form(tiny: study.Study) -> None:
    (slide,) = (case for case in tiny.cases if case.name == "slide")
    assert slide.reference.outcomes[0].slide == pytest.approx(0.254841997961, abs=1e-11)
    assert max(check.error for check in slide.reference.checks) < 1e-11


def test_other_states_and_early_ends_are_failures() -> None:
    true = outcome()
    assert failure(outcome(q=np.ones(3)), true) is None
    assert failure(outcome(q=np.full(3, -36.0)), true) == "error of 36 rad or m"
    assert failure(outcome(states=()), true) is None
    assert failure(outcome(states=(3, 1, 7)), true) == "other contact states from number 2 on"
    assert failure(outcome(states=(3, 3, 7), event_times=(0.3, 0.5)), true) is not None
    # An event without effect at the time of another event.
    assert failure(outcome(states=(3, 3, 7), event_times=(0.5, 0.5)), true) is None
    # Time-stepping may skip a contact state.
    assert failure(outcome(states=(3, 1, 7)), true, locates=False) is None
    assert failure(outcome(termination="fall", time=0.25), true) == "fall at 0.25 s"
    assert failure(outcome(q=np.array([0.0, np.nan, 0.0])), true) == "not finite"


def test_errors_are_the_largest_and_their_mean_is_quadratic() -> None:
    off = errors(outcome(q=np.array([0.0, -3.0, 2.0]), event_times=(0.4,), slide=0.3), outcome())
    assert off.position == 3.0
    assert off.event_time == pytest.approx(0.1) and off.slide == pytest.approx(0.2)
    assert off.energy == 1e-9 and off.pull is None
    both = root_mean_square([off, errors(outcome(states=(), event_times=()), outcome())])
    assert both.position == pytest.approx(3.0 / 2**0.5)
    # One of them has different events.
    assert both.event_time == pytest.approx(0.1)


def test_error_counts_only_far_above_the_disagreement() -> None:
    reference = Reference([outcome()], Errors(position=1e-10, slide=0.0))
    assert reference.trusts("position", 2e-8) and not reference.trusts("position", 5e-9)
    assert not reference.trusts("slide", 0.0)
    assert not reference.trusts("position", None)


def test_table_picks_the_cheapest_that_keeps_the_bound() -> None:
    def row(label: str, slide: float | None, time: float | None) -> study.Row:
        return study.Row(
            *("c", study.ENGINE, "rk4", label, None, False, 1),
            errors=Errors(slide=slide),
            time=time,
        )

    made = study.CaseStudy(
        *("c", "a case", 1.0, False, 1),
        Reference([outcome()], Errors()),
        [
            row("cheap", 1e-2, 1.0),
            row("good", 1e-5, 4.0),
            row("dear", 1e-7, 9.0),
            row("failed", None, 0.5),
            row("untimed", 0.0, None),
        ],
    )
    found = prices.prices(study.Study({}, 0, [made], []), bounds=(1e-1, 1e-4, 1e-6, 1e-9))
    assert [price.label for price in found] == ["cheap", "good", "dear", None]
    assert found[1].time == 4.0
    best = prices.cheapest(found)
    assert best is not None and best.label == "cheap"


def test_order_is_the_slope_of_trusted_errors() -> None:
    made = study.CaseStudy(
        *("c", "a case", 1.0, False, 1),
        Reference([outcome()], Errors(position=1e-13)),
        [
            study.Row(
                *("c", study.ENGINE, "rk4", f"{k}", 0.5**k, True, 1),
                errors=Errors(position=0.1 * 0.5 ** (4 * k)),
                trusted={"position": k < 5},
            )
            for k in range(7)
        ],
    )
    (order,) = prices.orders(study.Study({}, 0, [made], []))
    assert order.order == pytest.approx(4.0) and order.settings == 5


def test_csv_has_a_row_for_each_setting_with_the_versions(tiny: study.Study) -> None:
    made = list(csv.DictReader(io.StringIO(records.csv(tiny))))
    assert len(made) == sum(len(case.rows) for case in tiny.cases)
    for line in made:
        assert line["machine"] and line["skate_env"] and line["python"]
        failed = int(line["failures"]) > 0
        assert failed is bool(line["failure"])
        assert failed is (line["position [rad, m]"] == "")
    assert {"slide [m]", "energy [J]", "pull [N]", "cone_excess [N]"} <= set(made[0])
    assert {"time [s/s]", "evaluations [1/s]"} <= set(made[0])


def test_json_has_references_walks_and_prices(tiny: study.Study) -> None:
    said = json.loads(records.json(tiny))
    for case in said["cases"]:
        assert [check["solver"] for check in case["reference"]["cross_checks"]] == ["DOP853"]
        assert case["reference"]["self_change"]["position"] is not None
    assert len(said["walks"]) == len(TINY.settings)
    assert said["prices"] and said["stamp"]["skate_env"]


def test_summary_is_json(tiny: study.Study) -> None:
    said = json.loads(json.dumps(tiny.summary(), allow_nan=False))
    assert [case["name"] for case in said["cases"]] == ["swing", "slide", "landing"]
    assert said["cases"][1]["disagreement"]["slide"] is not None


def test_walk_makes_its_steps(tiny: study.Study) -> None:
    first = tiny.walks[0]
    assert (first.steps, first.termination) == (1, None)
    assert first.slide is not None and first.slide > 1.0


def test_mujoco_has_rows_of_its_own(monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("mujoco")
    theirs = import_module("skate_env.studies.accuracy.mujoco")
    some = theirs.settings(cases()["swing"], True)[:2]
    monkeypatch.setattr(theirs, "settings", lambda case, thin: some)
    made = study.make(["swing"], replace(TINY, steps=0, solvers=()))
    found = [row for row in made.cases[0].rows if row.tool == study.MUJOCO]
    assert [row.value for row in found] == [setting.timestep for setting in some]
    for row in found:
        assert row.fixed_step and row.time is not None
        assert row.failures or row.errors.position is not None


def test_missing_tools_are_reported(tiny: study.Study) -> None:
    assert tiny.notes[study.MUJOCO] == "mujoco is not installed"


def test_missing_scipy_is_reported(monkeypatch: pytest.MonkeyPatch) -> None:
    def missing() -> None:
        raise independent.Unavailable("scipy is not installed")

    monkeypatch.setattr(independent, "available", missing)
    made = study.make(["flight"], replace(TINY, settings=TINY.settings[:1], steps=0))
    assert made.notes["independent"] == "scipy is not installed"
    assert made.cases[0].reference.cross_checks == []


def test_an_unknown_motion_lists_the_known_ones() -> None:
    with pytest.raises(ValueError, match="no motion 'wings': name one of swing, flight"):
        study.make(["wings"], TINY)


def test_every_setting_is_known_to_the_engine_and_named_once() -> None:
    every = settings()
    assert len({(setting.method, setting.label) for setting in every}) == len(every)
    assert {setting.label for setting in every if setting.method == NAMED} == {
        "fast",
        "balanced",
        "reference",
    }
    for setting in every:
        cases()["swing"].with_accuracy(setting.accuracy)


def test_command_lists_the_motions_and_refuses_others() -> None:
    listed = CliRunner().invoke(app, ["accuracy", "--list"])
    assert listed.exit_code == 0
    assert [line.split()[0] for line in listed.stdout.splitlines()] == list(cases())
    refused = CliRunner().invoke(app, ["accuracy", "--scene", "wings"])
    assert refused.exit_code == 2 and "no motion 'wings'" in refused.output
