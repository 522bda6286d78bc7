"""The study's report on synthetic results, without simulation or timing."""

import re
from pathlib import Path

import numpy as np
import pytest

from skate_env import Scene
from skate_env.studies.accuracy import curves, report
from skate_env.studies.accuracy.chart import case_figure
from skate_env.studies.accuracy.outcome import Errors, Outcome
from skate_env.studies.accuracy.reference import CrossCheck, Reference
from skate_env.studies.accuracy.settings import NAMED
from skate_env.studies.accuracy.study import ENGINE, MUJOCO, CaseStudy, Row, Study
from skate_env.studies.accuracy.summary_chart import summary_figure
from skate_env.studies.accuracy.walk import Walk
from skate_env.studies.fronts import cost_at, front
from skate_env.studies.report import Table, significant

DISAGREEMENT = 1e-12
LIMIT = 1e-10
FAILED = 3


def row(tool: str, method: str, value: float, error: float | None, time: float) -> Row:
    """Make a setting; one without an error has failed."""
    made = Row("slide", tool, method, f"{value:g}", value, method != "dopri5", 2, time=time)
    if error is None:
        made.failures, made.failure = 1, "start 1: fall at 0.1 s"
    else:
        made.errors = Errors(position=error, slide=error)
        known = error > LIMIT
        made.trusted = {"position": known, "slide": known}
    if tool == ENGINE:
        made.evaluations = 1e6 * time
    return made


def case(failures: tuple[str, ...] = ()) -> CaseStudy:
    """Errors are 1e-12 (0.01 s / time)^4 for rk4 and 1e-3 s / time for MuJoCo."""
    gap = Errors(position=DISAGREEMENT, slide=DISAGREEMENT, event_time=0.0)
    reference = Reference(
        [Outcome(1.0, None, np.zeros(3), np.zeros(3), (1,), (), 0.1, 0.0, *[None] * 4, {})],
        gap,
        [CrossCheck("DOP853", 1e-13, 1, gap, failures)],
    )
    steps = [0.01 / 2**k for k in range(9)]
    rows = [row(ENGINE, "rk4", h, 1e-12 * (h / 1e-5) ** 4, 1e-7 / h) for h in steps[3:]]
    rows += [row(ENGINE, "rk4", h, None, 1e-7 / h) for h in steps[:FAILED]]
    rows += [row(ENGINE, "dopri5", 1e-9, 1e-14, 1e-3)]
    rows += [row(MUJOCO, "Euler", h, h, 1e-3 / h) for h in (1e-2, 1e-3, 1e-4, 1e-5)]
    balanced = row(ENGINE, "dopri5", 1e-6, 1e-7, 5e-4)
    balanced.method, balanced.label, balanced.value = NAMED, "balanced", None
    rows += [balanced]
    return CaseStudy("slide", "sliding to rest", 0.55, False, 2, reference, rows, 0.012)


@pytest.fixture
def study() -> Study:
    walk = Walk("rk4", "1 ms", 1e-3, 0, 20, "fall", 0.1, *[None] * 4, time=0.1, evaluations=9.0)
    stamp = {"machine": "a machine", "python": "3.12", "mujoco": "4.0"}
    return Study(stamp, 200, [case()], [walk], {"independent": "scipy is not installed"})


def test_cost_between_settings_is_a_power_of_the_error() -> None:
    made = case()
    rk4 = curves.methods(made, ENGINE)["rk4"]
    for error in (1e-4, 1e-6, 3e-7):
        expected = 1e-2 * (1e-12 / error) ** 0.25
        assert cost_at(curves.points(made, rk4), error) == pytest.approx(expected)


def test_cost_is_not_extrapolated() -> None:
    made = case()
    euler = curves.points(made, curves.methods(made, MUJOCO)["Euler"])
    assert cost_at(euler, 0.5) == pytest.approx(0.1)
    assert cost_at(euler, 1e-5) == pytest.approx(100.0)
    assert cost_at(euler, 0.9e-5) is None
    assert cost_at([], 1.0) is None


def test_dominated_settings_do_not_count() -> None:
    rows = [row(ENGINE, "rk4", 1.0, *both) for both in ((1e-2, 1.0), (1e-3, 2.0), (5e-3, 3.0))]
    points = curves.points(case(), [*rows, row(ENGINE, "rk4", 1.0, 1e-4, 4.0)])
    assert [point.cost for point in front(points)] == [1.0, 2.0, 4.0]


def test_ratio_divides_the_best_of_both_at_equal_error() -> None:
    found = {ratio.error: ratio for ratio in curves.ratios(case())}
    for error in (1e-3, 1e-4):
        ours = min(1e-2 * (1e-12 / error) ** 0.25, 1e-3)
        # The coarsest step that succeeds has an error of 2.4e-4.
        ours = max(ours, 8e-5)
        assert found[error].value == pytest.approx(1e-3 / error / ours), error
    missing = found[1e-6]
    assert missing.theirs is None and missing.value is None and missing.known
    assert missing.ours is not None and missing.ours.method == "rk4"


def test_untrusted_errors_count_as_the_smallest_known_error() -> None:
    made = case()
    (point,) = curves.points(made, curves.methods(made, ENGINE)["dopri5"])
    assert point.error == pytest.approx(LIMIT)
    (finest,) = curves.ratios(made, [1e-11])
    assert not finest.known and finest.ours is None


def test_named_accuracies_are_not_separate_methods() -> None:
    assert NAMED not in curves.methods(case(), ENGINE)


def test_motions_with_different_references_are_excluded(study: Study, tmp_path: Path) -> None:
    torn = case(("0: other contact states from number 2 on",))
    assert curves.limit(torn) is None
    assert curves.points(torn, torn.rows) == []
    study.cases = [torn]
    assert "the references have different motions" in report.text(study)
    report.write(study, tmp_path, "skate-env accuracy")


def test_text_has_failures_prices_and_notes(study: Study) -> None:
    printed = report.text(study)
    rk4 = next(line for line in printed.splitlines() if line.startswith("  rk4    "))
    assert rk4.split()[-1] == f"{FAILED}/9"
    assert "MuJoCo / skate_env" in printed
    missing = [line for line in printed.splitlines() if "not reached" in line]
    (ratio,) = (line for line in missing if line.startswith("  slide "))
    assert ratio.count("not reached") == 4
    for said in (
        "Cheapest setting for each bound of the slide distance's error",
        "1 mm",
        "0.1 mm",
        "1 um",
        "slide 1.2%",
        "DOP853",
        "machine a machine",
        "scipy is not installed",
    ):
        assert said in printed, said
    assert re.search(r"rk4 1 ms +0/20 +- +- +-\n", printed)


def test_errors_below_the_resolution_are_in_brackets(study: Study) -> None:
    made = study.cases[0]
    balanced = made.rows[-1]
    assert "1.0e-07" in report.named_table([made]).rows[0]
    balanced.errors, balanced.trusted = Errors(position=1e-13), {"position": False}
    assert "(1.0e-13)" in report.named_table([made]).rows[0]
    balanced.failures = 1
    assert "fails" in report.named_table([made]).rows[0]


def test_folder_holds_tables_figures_and_fragment(study: Study, tmp_path: Path) -> None:
    report.write(study, tmp_path, "skate-env accuracy --quick")
    names = {path.name for path in tmp_path.iterdir()}
    assert {"accuracy.md", "accuracy.csv", "accuracy.png", "accuracy_slide.png"} <= names
    for name in ("accuracy.png", "accuracy_slide.png"):
        assert (tmp_path / name).read_bytes().startswith(b"\x89PNG")
    fragment = (tmp_path / "accuracy.md").read_text(encoding="utf-8")
    assert fragment.startswith("By `skate-env accuracy --quick`")
    tables = [block for block in fragment.split("\n\n") if block.startswith("|")]
    assert len(tables) >= 4
    for block in tables:
        assert len({line.count("|") for line in block.splitlines()}) == 1


def test_figure_shows_failures_as_crosses_and_no_untrusted_number(study: Study) -> None:
    made = study.cases[0]
    figure = case_figure(made)
    assert len(figure.axes) == 4
    for ax in figure.axes:
        crosses = [line for line in ax.lines if line.get_marker() == "X"]
        assert len(crosses) == FAILED
        highest = max(
            np.max(line.get_ydata())
            for line in ax.lines
            if line.get_marker() != "X" and len(line.get_ydata())
        )
        assert all(line.get_ydata()[0] > highest for line in crosses)
        plotted = np.concatenate([line.get_ydata() for line in ax.lines])
        assert plotted.min() == pytest.approx(LIMIT)
        hollow = [line for line in ax.lines if line.get_marker() == "v"]
        assert any(len(line.get_ydata()) for line in hollow)
    made.smooth = True
    assert len(case_figure(made).axes) == 2


def test_failed_steps_have_the_cost_of_equal_steps(study: Study) -> None:
    """The time of a terminated run is not used; fixed steps cost the same as in other runs."""
    made = study.cases[0]
    failed = [one for one in made.rows if one.failures]
    for one in failed:
        one.time = None
    time = case_figure(made).axes[0]
    shown = sorted(line.get_xdata()[0] for line in time.lines if line.get_marker() == "X")
    assert shown == pytest.approx([1e6 * 1e-7 / one.value for one in failed if one.value])


def test_summary_writes_the_ratio_to_mujoco(study: Study) -> None:
    (ax,) = [ax for ax in summary_figure(study).axes if ax.get_visible()]
    (ratio,) = curves.ratios(study.cases[0], [1e-3])
    assert ratio.value is not None
    assert f"{ratio.value:.0f}x" in [text.get_text() for text in ax.texts]


def test_tables_escape_markup_and_align() -> None:
    table = Table("a < b", ("x|y", "n"), [("long name", "1"), ("s", "-")])
    assert table.text().splitlines()[1:] == ["  x|y        n", "  long name  1", "  s          -"]
    assert table.markdown().splitlines()[0] == r"a \< b" and r"x\|y" in table.markdown()
    assert [significant(x) for x in (1970.4, 12.345, 0.0872, None)] == [
        "1970",
        "12.3",
        "0.0872",
        "-",
    ]


PAGE = Path(__file__).parents[1] / "docs" / "accuracy.md"


def test_scenes_of_the_documentation_are_valid() -> None:
    examples = re.findall(r"^```toml\n(.*?)^```", PAGE.read_text(encoding="utf-8"), re.M | re.S)
    settings = [line for each in examples for line in each.splitlines() if line.startswith("acc")]
    assert len(settings) >= 4
    for setting in settings:
        Scene.from_toml(setting)


def test_documentation_holds_the_tables() -> None:
    made = (PAGE.parent / "generated" / "accuracy.md").read_text(encoding="utf-8")
    assert made.startswith("By `skate-env accuracy` (machine ")
    assert "](generated/accuracy.md)" in PAGE.read_text(encoding="utf-8")
