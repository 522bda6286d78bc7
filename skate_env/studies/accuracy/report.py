"""The study for people: text, Markdown, tables and pictures in a folder."""

import math
import textwrap
from collections.abc import Iterator, Sequence
from pathlib import Path

from . import table, tables
from .chart import case_figure
from .curves import DECADES, Ratio, cost_at, limit, methods, points, ratios
from .layout import EMPTY, Table, escaped, length, scientific, significant
from .reference import MARGIN
from .settings import NAMED
from .study import ENGINE, MUJOCO, CaseStudy, Row, Study
from .summary_chart import summary_figure

_WIDTH = 100
_MICRO = 1e6
_UNKNOWN = "?"
# Of the summary and of a motion's figure [1/inch].
_DOTS, _DOTS_EACH = 150, 110


def text(study: Study) -> str:
    """Lay the study out for a terminal."""
    parts = []
    for case in study.cases:
        parts += [case_table(case).text() + "\n" + named_table([case]).text()]
    parts += [table.text(study)] if table.prices(study) else []
    parts += [made.text() for made in _whole(study)]
    parts += [
        "\n".join(textwrap.fill(note, _WIDTH, subsequent_indent="  ") for note in notes(study))
    ]
    return "\n\n".join(parts)


def markdown(study: Study, command: str) -> str:
    """Write the tables for the documentation."""
    versions = ", ".join(f"{name} {it}" for name, it in study.stamp.items() if it)
    parts = [f"By `{command}` ({versions}).", named_table(study.cases).markdown()]
    parts += [price_table(study).markdown()] if table.prices(study) else []
    parts += [order_table(study).markdown()] if table.orders(study) else []
    parts += [made.markdown() for made in _whole(study)]
    parts += ["\n".join(f"- {escaped(note)}" for note in notes(study))]
    return "\n\n".join(parts) + "\n"


def write(study: Study, folder: Path, command: str) -> None:
    """Leave CSV files, accuracy.md, accuracy.png and a figure for each motion in a folder."""
    tables.write(study, folder)
    (folder / "accuracy.md").write_text(markdown(study, command), encoding="utf-8")
    summary_figure(study).savefig(folder / "accuracy.png", dpi=_DOTS)
    for case in study.cases:
        case_figure(case).savefig(folder / f"accuracy_{case.name}.png", dpi=_DOTS_EACH)


def _whole(study: Study) -> Iterator[Table]:
    """Give the tables about all motions."""
    if any(methods(case, MUJOCO) for case in study.cases):
        yield ratio_table(study)
    if study.walks:
        yield walk_table(study)
    yield reference_table(study)


def case_table(case: CaseStudy) -> Table:
    """Tabulate what a motion costs by each method at each error."""
    orders = {(order.tool, order.method): order.order for order in table.case_orders(case)}
    rows = []
    for tool in (ENGINE, MUJOCO):
        for method, settings in methods(case, tool).items():
            curve = points(case, settings)
            cells = [_cost(case, cost_at(curve, error), error) for error in DECADES]
            name = method if tool == ENGINE else f"MuJoCo {method}"
            lost = sum(row.failures > 0 for row in settings)
            order = _order(orders.get((tool, method)))
            rows.append((name, *cells, order, f"{lost}/{len(settings)}"))
    found = ratios(case)
    if any(ratio.theirs for ratio in found):
        cells = [_ratio(ratio, EMPTY) for ratio in found]
        rows.append(("MuJoCo's best / ours", *cells, "", ""))
    head = ("us for a simulated second", *map(_decade, DECADES), "order", "failed")
    return Table(f"{case.name}: {case.title} ({case.duration:g} s)", head, rows)


def named_table(cases: Sequence[CaseStudy]) -> Table:
    """Tabulate the accuracies that have a name."""
    rows = []
    for case in cases:
        for row in case.rows:
            if row.method == NAMED:
                what = row.label if len(cases) == 1 else f"{case.name}, {row.label}"
                rows.append((what, *_named(row)))
    head = (
        "accuracy",
        "state [rad, m]",
        "slide [m]",
        "event [s]",
        "energy [J]",
        "time [us/s]",
        "x real time",
        "evaluations [1/s]",
    )
    return Table("The accuracies that have a name: errors and cost", head, rows)


def _named(row: Row) -> tuple[str, ...]:
    errors = row.errors
    speed = None if not row.time else 1.0 / row.time
    time = None if row.time is None else _MICRO * row.time
    costs = (significant(time), significant(speed), significant(row.evaluations))
    if row.failures:
        return ("fails", *[EMPTY] * 3, *costs)
    sure = [_small(row, name) for name in ("position", "slide", "event_time")]
    return (*sure, scientific(errors.energy), *costs)


def _small(row: Row, quantity: str) -> str:
    """Put errors that are too small to be known in brackets."""
    error = getattr(row.errors, quantity)
    if error is None:
        return EMPTY
    if error == 0.0:
        return "0"
    return scientific(error) if row.trusted.get(quantity) else f"({scientific(error)})"


def price_table(study: Study) -> Table:
    """Tabulate the cheapest setting that keeps an error of the slide distance."""
    every = table.prices(study)
    bounds = list(dict.fromkeys(price.bound for price in every))
    rows = []
    for case in study.cases:
        for tool, name in ((ENGINE, "ours"), (MUJOCO, "MuJoCo")):
            here = [price for price in every if (price.case, price.tool) == (case.name, tool)]
            if here:
                best = [table.cheapest(p for p in here if p.bound == bound) for bound in bounds]
                rows.append((f"{case.name}, {name}", *map(_price, best)))
    head = ("us for a simulated second", *map(length, bounds))
    return Table("What an error in slide distance costs: the cheapest setting", head, rows)


def _price(price: table.Price | None) -> str:
    if price is None or price.time is None:
        return "not reached"
    return f"{significant(_MICRO * price.time)} ({price.method} {price.label})"


def ratio_table(study: Study) -> Table:
    """Tabulate by how much MuJoCo's best takes longer than ours."""
    rows = [
        (case.name, *(_ratio(ratio) for ratio in ratios(case)))
        for case in study.cases
        if methods(case, MUJOCO)
    ]
    title = "Time of MuJoCo's best divided by ours, at equal errors of the state [rad, m]"
    return Table(title, ("motion", *map(_decade, DECADES)), rows)


def order_table(study: Study) -> Table:
    """Tabulate measured orders of the engine's methods with fixed steps."""
    found = {
        (order.case, order.method): order.order
        for order in table.orders(study)
        if order.tool == ENGINE
    }
    kinds = dict.fromkeys(method for _, method in found)
    rows = [
        (case.name, *(_order(found.get((case.name, method))) for method in kinds))
        for case in study.cases
    ]
    return Table("Power of the step with which the error falls", ("motion", *kinds), rows)


def walk_table(study: Study) -> Table:
    """Tabulate the long walks."""
    rows = []
    for walk in study.walks:
        made = f"{walk.steps}/{walk.wanted}"
        means = ((walk.slide, walk.slide_deviation), (walk.period, walk.period_deviation))
        cells = (
            EMPTY if mean is None else f"{mean:.4f} +- {spread or 0.0:.4f}"
            for mean, spread in means
        )
        name = walk.label if walk.method == NAMED else f"{walk.method} {walk.label}"
        rows.append((name, made, *cells, significant(1.0 / walk.time if walk.steps else None)))
    head = ("setting", "steps", "slide [m]", "period [s]", "x real time")
    return Table(
        "A long walk: means of its steps and their spread; its time was measured once", head, rows
    )


def reference_table(study: Study) -> Table:
    """Tabulate how far the references disagree."""
    rows = []
    for case in study.cases:
        truth = case.reference
        gap = truth.disagreement
        solvers = ", ".join(opinion.solver for opinion in truth.opinions) or "none"
        closed = max((check.error for check in truth.checks), default=None)
        sizes = map(scientific, (gap.position, gap.slide, gap.event_time, closed))
        rows.append((case.name, *sizes, solvers if truth.sure else f"{solvers}: other motion"))
    head = ("motion", "state [rad, m]", "slide [m]", "event [s]", "closed form", "against")
    return Table("How far the references disagree", head, rows)


def notes(study: Study) -> Iterator[str]:
    """Say what the figures are, and how sure they are."""
    yield (
        "error of the state: the largest of all coordinates at the end of the motion, root mean "
        "square over starts that differ by little. slide: way of the supporting foot. event: the "
        "instant that is furthest off. energy: what its account does not explain."
    )
    yield (
        "time: least of all rounds, in which the settings of a motion take turns; it is that of "
        "the scene's own start. Costs between two settings are interpolated, as a power of the "
        "error; settings that cost more than a better one are left out, and of several methods "
        f"the cheapest counts. {EMPTY}: no setting gets there; {_UNKNOWN}: the references do not "
        "know the motion that well."
    )
    yield (
        "failed: settings that make another motion, pass other contact states or end early from at "
        "least one start; they have no error. Time-stepping may pass over short states."
    )
    yield (
        f"references: errors count from {MARGIN:g} times their disagreement on; smaller ones stand "
        "in brackets, and cost what that much costs. The reference is dopri5 at its tightest."
    )
    spreads = ", ".join(f"{case.name} {case.time_error:.1%}" for case in study.cases)
    yield f"halves of the {study.rounds} rounds disagree by at most: {spreads}."
    for case in study.cases:
        if limit(case) is None:
            said = "; ".join(x for o in case.reference.opinions for x in o.failures)
            yield f"{case.name}: the references see other motions ({said}); no error counts."
    yield from (f"{name}: {said}." for name, said in study.notes.items())
    yield (
        "measured with: "
        + ", ".join(f"{name} {it}" for name, it in study.stamp.items() if it)
        + "."
    )


def _cost(case: CaseStudy, cost: float | None, error: float) -> str:
    least = limit(case)
    if cost is None:
        return EMPTY if least is not None and error >= least else _UNKNOWN
    return significant(_MICRO * cost)


def _ratio(ratio: Ratio, missing: str = "not reached") -> str:
    if ratio.value is not None:
        return significant(ratio.value)
    if not ratio.known:
        return _UNKNOWN
    return EMPTY if ratio.ours is None else missing


def _order(order: float | None) -> str:
    return EMPTY if order is None else f"{order:.1f}"


def _decade(error: float) -> str:
    return f"1e{math.log10(error):.0f}"
