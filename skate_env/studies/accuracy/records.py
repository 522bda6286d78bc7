"""The study as CSV tables; each row holds the versions and the machine of its measurement."""

from collections.abc import Iterable
from dataclasses import asdict
from typing import Any

from ..report import as_csv
from .outcome import COMPARED, QUANTITIES
from .prices import orders, prices
from .study import CaseStudy, Row, Study

_UNITS = {
    "position": "rad, m",
    "event_time": "s",
    "slide": "m",
    "energy": "J",
    "drift": "m",
    "penetration": "m",
    "pull": "N",
    "cone_excess": "N",
    "position to its own limit": "rad, m",
    # Costs per simulated second.
    "time": "s/s",
    "evaluations": "1/s",
    "factorisations": "1/s",
    "steps": "1/s",
}
_SETTING = ("case", "tool", "method", "label", "value", "fixed_step")
_FAILURES = ("starts", "failures", "failure", "other_states")
_COSTS = ("time", "evaluations", "factorisations", "steps")


def tables(study: Study) -> dict[str, str]:
    """Return accuracy.csv and accuracy_{reference,prices,orders,walks}.csv by name."""
    rows = (_row(row) for case in study.cases for row in case.rows)
    references = (row for case in study.cases for row in _references(case))

    def stamped(records: Iterable[dict[str, Any]]) -> Iterable[dict[str, Any]]:
        return (record | study.stamp for record in records)

    return {
        "accuracy.csv": as_csv(stamped(rows), _UNITS),
        "accuracy_reference.csv": as_csv(stamped(references), _UNITS),
        "accuracy_prices.csv": as_csv(stamped(map(asdict, prices(study)))),
        "accuracy_orders.csv": as_csv(stamped(map(asdict, orders(study)))),
        "accuracy_walks.csv": as_csv(stamped(map(asdict, study.walks))),
    }


def _row(row: Row) -> dict[str, Any]:
    return {
        **{name: getattr(row, name) for name in (*_SETTING, *_FAILURES)},
        **{name: getattr(row.errors, name) for name in QUANTITIES},
        **{f"{name} trusted": row.trusted.get(name, False) for name in COMPARED},
        "position to its own limit": row.to_limit and row.to_limit.position,
        **{name: getattr(row, name) for name in _COSTS},
    }


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
            **{name: getattr(difference, name) for name in COMPARED},
            "closed form": checks,
        }
