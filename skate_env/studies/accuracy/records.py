"""The study for programs: its settings as a CSV table, all of it as JSON."""

from dataclasses import asdict
from typing import Any

from ..report import as_csv, as_json
from .outcome import COMPARED, QUANTITIES
from .prices import orders, prices
from .study import Row, Study

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


def csv(study: Study) -> str:
    """Format a row for each motion, method and setting, with the versions of its measurement."""
    rows = (row for case in study.cases for row in case.rows)
    return as_csv((_row(row) | study.stamp for row in rows), _UNITS)


def json(study: Study) -> str:
    """Format everything, with the cheapest settings and the measured orders."""
    derived = {
        "prices": list(map(asdict, prices(study))),
        "orders": list(map(asdict, orders(study))),
    }
    return as_json(study.summary() | derived)


def _row(row: Row) -> dict[str, Any]:
    return {
        **{name: getattr(row, name) for name in (*_SETTING, *_FAILURES)},
        **{name: getattr(row.errors, name) for name in QUANTITIES},
        **{f"{name} trusted": row.trusted.get(name, False) for name in COMPARED},
        "position to its own limit": row.to_limit and row.to_limit.position,
        **{name: getattr(row, name) for name in _COSTS},
    }
