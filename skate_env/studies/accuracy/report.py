"""Reports of the study: text, Markdown, tables and figures."""

import math
from collections.abc import Iterator, Sequence
from pathlib import Path

from ...common import files
from .. import report
from ..fronts import cost_at
from ..report import EMPTY, Notes, Part, Table, described, scientific, significant
from . import records
from .chart import case_figure
from .curves import DECADES, Ratio, limit, methods, points, ratios
from .prices import Price, case_orders, cheapest, orders, prices
from .reference import MARGIN
from .settings import NAMED
from .study import ENGINE, MUJOCO, CaseStudy, Row, Study
from .summary_chart import summary_figure

_MICRO = 1e6
_UNKNOWN = "?"


def text(study: Study) -> str:
    """Format the study for a terminal."""
    parts: list[Part] = []
    for case in study.cases:
        parts += [case_table(case), named_table([case])]
    parts += [price_table(study)] if prices(study) else []
    return report.text([*parts, *_whole(study), Notes(list(notes(study)))])


def markdown(study: Study, command: str) -> str:
    """Format the tables as Markdown."""
    parts: list[Part] = [f"By `{command}` ({described(study.stamp)})."]
    parts += [named_table(study.cases)]
    parts += [price_table(study)] if prices(study) else []
    parts += [order_table(study)] if orders(study) else []
    return report.markdown([*parts, *_whole(study), Notes(list(notes(study)))])


@files.own_style
def write(study: Study, folder: Path, command: str) -> None:
    """Write accuracy.{md,csv,json,png} and a figure for each motion into a folder."""
    figures = {f"accuracy_{case.name}.png": case_figure(case) for case in study.cases}
    texts = {
        "accuracy.md": markdown(study, command),
        "accuracy.csv": records.csv(study),
        "accuracy.json": records.json(study),
    }
    report.write(folder, texts, {"accuracy.png": summary_figure(study), **figures})


def _whole(study: Study) -> Iterator[Table]:
    """Yield the tables about all motions."""
    if any(methods(case, MUJOCO) for case in study.cases):
        yield ratio_table(study)
    if study.walks:
        yield walk_table(study)
    yield reference_table(study)


def case_table(case: CaseStudy) -> Table:
    """Tabulate the cost of a motion for each method and error."""
    fitted = {(order.tool, order.method): order.order for order in case_orders(case)}
    rows = []
    for tool in (ENGINE, MUJOCO):
        for method, settings in methods(case, tool).items():
            curve = points(case, settings)
            cells = [_cost(case, cost_at(curve, error), error) for error in DECADES]
            name = method if tool == ENGINE else f"MuJoCo {method}"
            lost = sum(row.failures > 0 for row in settings)
            order = _order(fitted.get((tool, method)))
            rows.append((name, *cells, order, f"{lost}/{len(settings)}"))
    found = ratios(case)
    if any(ratio.theirs for ratio in found):
        cells = [_ratio(ratio, EMPTY) for ratio in found]
        rows.append(("MuJoCo / skate_env", *cells, "", ""))
    head = ("us per simulated second", *map(_decade, DECADES), "order", "failed")
    return Table(f"{case.name}: {case.title} ({case.duration:g} s)", head, rows)


def named_table(cases: Sequence[CaseStudy]) -> Table:
    """Tabulate the named accuracies."""
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
        "real-time factor",
        "evaluations [1/s]",
    )
    return Table("Named accuracies: errors and cost", head, rows)


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
    """Format an error, in brackets if it is not trusted."""
    error = getattr(row.errors, quantity)
    if error is None:
        return EMPTY
    if error == 0.0:
        return "0"
    return scientific(error) if row.trusted.get(quantity) else f"({scientific(error)})"


def price_table(study: Study) -> Table:
    """Tabulate the cheapest setting for each bound of the slide distance's error."""
    every = prices(study)
    bounds = list(dict.fromkeys(price.bound for price in every))
    rows = []
    for case in study.cases:
        for tool, name in ((ENGINE, ENGINE), (MUJOCO, "MuJoCo")):
            here = [price for price in every if (price.case, price.tool) == (case.name, tool)]
            if here:
                best = [cheapest(p for p in here if p.bound == bound) for bound in bounds]
                rows.append((f"{case.name}, {name}", *map(_price, best)))
    head = ("us per simulated second", *map(_length, bounds))
    title = "Cheapest setting for each bound of the slide distance's error"
    return Table(title, head, rows)


def _price(price: Price | None) -> str:
    if price is None or price.time is None:
        return "not reached"
    return f"{significant(_MICRO * price.time)} ({price.method} {price.label})"


def ratio_table(study: Study) -> Table:
    """Tabulate the time of MuJoCo's cheapest method relative to the engine's."""
    rows = [
        (case.name, *(_ratio(ratio) for ratio in ratios(case)))
        for case in study.cases
        if methods(case, MUJOCO)
    ]
    title = "Time of MuJoCo divided by that of skate_env at equal errors of the state [rad, m]"
    return Table(title, ("motion", *map(_decade, DECADES)), rows)


def order_table(study: Study) -> Table:
    """Tabulate measured orders of the engine's methods with fixed steps."""
    found = {
        (order.case, order.method): order.order for order in orders(study) if order.tool == ENGINE
    }
    kinds = dict.fromkeys(method for _, method in found)
    rows = [
        (case.name, *(_order(found.get((case.name, method))) for method in kinds))
        for case in study.cases
    ]
    return Table(
        "Measured convergence orders of the methods with fixed steps", ("motion", *kinds), rows
    )


def walk_table(study: Study) -> Table:
    """Tabulate the long simulations."""
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
    head = ("setting", "steps", "slide [m]", "period [s]", "real-time factor")
    return Table("Long simulation: means and standard deviations over its gait steps", head, rows)


def reference_table(study: Study) -> Table:
    """Tabulate the disagreement of the references."""
    rows = []
    for case in study.cases:
        truth = case.reference
        gap = truth.disagreement
        solvers = ", ".join(check.solver for check in truth.cross_checks) or "none"
        closed = max((check.error for check in truth.checks), default=None)
        sizes = map(scientific, (gap.position, gap.slide, gap.event_time, closed))
        rows.append((case.name, *sizes, solvers if truth.sure else f"{solvers}: different motion"))
    head = ("motion", "state [rad, m]", "slide [m]", "event [s]", "closed form", "against")
    return Table("Disagreement of the references", head, rows)


def notes(study: Study) -> Iterator[str]:
    """Explain the quantities and their uncertainty."""
    yield (
        "state: largest error of a coordinate at the end of the motion, root mean square over "
        "slightly different starts. slide: error of the supporting foot's displacement. event: "
        "largest error of an event time. energy: energy change that is not accounted for."
    )
    yield (
        "time: least of all rounds from the scene's own start; the settings of a motion are timed "
        "alternately. Costs between two settings are interpolated as a power of the error. "
        "Settings that cost more than a more accurate one are left out, and the cheapest method "
        f"counts. {EMPTY}: no setting reaches the error; {_UNKNOWN}: the references are not "
        "accurate enough."
    )
    yield (
        "failed: settings with a different motion, different contact states or an early end from "
        "at least one start; they have no error. Time-stepping may skip short contact states."
    )
    yield (
        f"references: errors below {MARGIN:g} times the references' disagreement are in brackets; "
        "their cost is that of this bound. The reference is dopri5 at its tightest tolerance."
    )
    spreads = ", ".join(f"{case.name} {case.time_error:.1%}" for case in study.cases)
    yield f"times differ between both halves of the {study.rounds} rounds by at most: {spreads}."
    for case in study.cases:
        if limit(case) is None:
            cause = "; ".join(x for o in case.reference.cross_checks for x in o.failures)
            yield f"{case.name}: the references have different motions ({cause}), no trusted error."
    yield from (f"{name}: {note}." for name, note in study.notes.items())
    yield f"measured with: {described(study.stamp)}."


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


def _length(metres: float) -> str:
    """Format a bound of the slide distance."""
    return f"{1e3 * metres:g} mm" if metres >= 1e-5 else f"{1e6 * metres:g} um"
