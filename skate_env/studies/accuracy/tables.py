"""The study as CSV files; each row holds the versions and the machine of its measurement."""

from collections.abc import Iterable, Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any

from ...common import write_csv
from .outcome import COMPARED, QUANTITIES
from .study import CaseStudy, Row, Study
from .table import orders, prices

_UNITS = {
    "position": "rad, m",
    "event_time": "s",
    "slide": "m",
    "energy": "J",
    "drift": "m",
    "penetration": "m",
    "pull": "N",
    "cone_excess": "N",
}
# Costs per simulated second.
_COSTS = {
    "time": "time [s/s]",
    "evaluations": "evaluations [1/s]",
    "factorisations": "factorisations [1/s]",
    "steps": "steps [1/s]",
    "instructions": "instructions [1/s]",
}


def write(study: Study, folder: Path) -> None:
    """Write accuracy.csv and accuracy_{reference,prices,orders,walks}.csv into a folder."""
    for name, rows in (
        ("accuracy", map(_row, (row for case in study.cases for row in case.rows))),
        ("accuracy_reference", (row for case in study.cases for row in _references(case))),
        ("accuracy_prices", ({**asdict(price)} for price in prices(study))),
        ("accuracy_orders", map(asdict, orders(study))),
        ("accuracy_walks", map(asdict, study.walks)),
    ):
        _write(folder / f"{name}.csv", rows, study.stamp)


def _write(path: Path, rows: Iterable[Mapping[str, Any]], stamp: Mapping[str, str]) -> None:
    stamped = [{**row, **stamp} for row in rows]
    header = [list(stamped[0])] if stamped else []
    write_csv(path, [*header, *(row.values() for row in stamped)])


def _row(row: Row) -> dict[str, Any]:
    plain = (
        "case",
        "tool",
        "method",
        "label",
        "value",
        "fixed_step",
        "starts",
        "failures",
        "failure",
        "other_states",
    )
    cells: dict[str, Any] = {name: getattr(row, name) for name in plain}
    for name in QUANTITIES:
        cells[f"{name} [{_UNITS[name]}]"] = getattr(row.errors, name)
    for name in COMPARED:
        cells[f"{name} trusted"] = row.trusted.get(name, False)
    cells["position to its own limit [rad, m]"] = row.to_limit and row.to_limit.position
    for name, title in _COSTS.items():
        cells[title] = getattr(row, name)
    return cells


def _references(case: CaseStudy) -> Iterable[dict[str, Any]]:
    """Yield a row for each independent reference and for the next coarser tolerance."""
    reference = case.reference
    own = ("next coarser tolerance", None, case.starts, 0, "", reference.self_change)
    others = [
        (o.solver, o.tolerance, o.starts, len(o.failures), "; ".join(o.failures), o.difference)
        for o in reference.cross_checks
    ]
    checks = "; ".join(f"{c.what}: {c.error:.2e} {c.unit}" for c in reference.checks)
    for solver, tolerance, starts, failures, said, difference in (own, *others):
        yield {
            "case": case.name,
            "against": solver,
            "tolerance": tolerance,
            "starts": starts,
            "failures": failures,
            "failure": said,
            **{f"{name} [{_UNITS[name]}]": getattr(difference, name) for name in COMPARED},
            "closed form": checks,
        }
