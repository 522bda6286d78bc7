"""The lines of a card with a number per contact state, end of a sole, joint, or accuracy."""

import numpy as np

from . import contact, effort
from .line import ONE, Limit, Line
from .robustness import SIGMA, STARTS

TABLES: tuple[Line, ...] = (
    Line(
        "dwell",
        "time per step",
        "ms",
        "mean time per step; sums to the period",
        contact.dwell,
        rows="state",
    ),
    Line(
        "last_state",
        "last before the swap",
        "1",
        "share of the steps that end in the state; visits shorter than 2 ms are left out",
        contact.last_states,
        rows="state",
    ),
    Line(
        "end_pull",
        "largest pull",
        "body weights",
        "largest negative normal force",
        lambda m: contact.pull(m, np.max),
        rows="end of a sole",
    ),
    Line(
        "end_mean_pull",
        "mean pull",
        "body weights",
        "mean over the time of the negative normal force, 0 where the end pushes or is in the air",
        lambda m: contact.pull(m, np.mean),
        rows="end of a sole",
    ),
    Line(
        "feedforward",
        "peak feedforward",
        "N m",
        "largest torque of Eqs. 16 to 22: tau1 for q1, and so on",
        lambda m: effort.peaks(m, m.feedforward),
        rows="joint",
    ),
    Line(
        "feedback",
        "peak feedback",
        "N m",
        "largest torque of visual lifting and stabilizers",
        lambda m: effort.peaks(m, m.feedback),
        rows="joint",
    ),
    Line(
        "total",
        "peak total",
        "N m",
        "largest total torque, with that of a policy",
        lambda m: effort.peaks(m, m.samples.torque),
        rows="joint",
    ),
    Line(
        "rates",
        "peak rate",
        "rad/s",
        "largest rate",
        lambda m: effort.peaks(m, m.samples.v),
        rows="joint",
    ),
)

# With a number per accuracy.
ROBUSTNESS: tuple[Line, ...] = (
    Line(
        "steps_made",
        "steps made",
        "1",
        "share of the steps asked for that are made from the scene's own start",
        lambda run: run.steps / run.asked,
        required=ONE,
    ),
    Line(
        "survived",
        "perturbed starts",
        "1",
        f"number of {STARTS} starts, perturbed by {SIGMA:g} (`Simulator.perturb`), that make all "
        "steps",
        lambda run: float(run.survived),
        required=Limit(STARTS, STARTS),
    ),
    Line(
        "perturbed_in_order",
        "their steps in the order",
        "1",
        "share of the complete steps from perturbed starts",
        lambda run: run.in_order,
    ),
    Line(
        "perturbed_in_order_standing",
        "with state 1 as state 3",
        "1",
        "the same with state 1 counted as state 3",
        lambda run: run.in_order_standing,
    ),
)
