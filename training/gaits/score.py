"""The score of a gait: how far its card is from the requirements on the paper's gait.

A run of N steps has the score

    missing + s / (1 + s),    s = sum of weight * distance / unit over `TERMS`

where ``missing`` is N - 1 minus the complete steps, and ``distance`` that of a line of the card
from its limits. One more step is always better. An invalid start scores N.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from skate_env import Scene, Simulator
from skate_env.gait import ORDER, SAMPLE_PERIOD, Motion, StepOrder, skate
from skate_env.scenes import replace

from . import measures
from .limits import LINES, ONE, Limit


@dataclass(frozen=True)
class Term:
    """A term of the score.

    Attributes
    ----------
    measure
        Value of a motion.
    required, human
        Limits of the value, for the paper's gait and with `--human`.
    unit
        Distance from the limits that counts as much as one unit of another term.
    weight
        Factor.
    """

    measure: Callable[[Motion], float]
    required: Limit
    unit: float
    weight: float = 1.0
    human: Limit | None = None

    def limit(self, human: bool) -> Limit:
        """Limits of the value; a human's where there is one."""
        return self.human if human and self.human else self.required


def known_terms() -> list[str]:
    """Names of the terms, for weights."""
    return [*TERMS, "arms"]


def similarity(step: StepOrder) -> float:
    """Similarity of a step's states and the paper's order, from 0 to 1.

    Twice the length of their longest common subsequence over the sum of their lengths.
    """
    states = step.sequence()
    longest = np.zeros((len(states) + 1, len(ORDER) + 1), int)
    for i, state in enumerate(states, start=1):
        for j, wanted in enumerate(ORDER, start=1):
            longest[i, j] = (
                longest[i - 1, j - 1] + 1
                if state == wanted
                else max(longest[i - 1, j], longest[i, j - 1])
            )
    return float(2.0 * longest[-1, -1] / (len(states) + len(ORDER)))


def arms(motion: Motion) -> float:
    """Correlation of both shoulders over the second half; 1 if one of them rests or is locked."""
    recording = motion.recording
    first, other = recording.index("q11"), recording.index("q14")
    if first is None or other is None:
        return 1.0
    later = recording.q[recording.t.size // 2 :]
    right, left = later[:, first], later[:, other]
    still = min(np.ptp(right), np.ptp(left)) < 1e-9
    return 1.0 if still else float(np.corrcoef(right, left)[0, 1])


def damping(motion: Motion) -> float:
    """Sum of the gains of head damping [N s/m]."""
    return float(sum((motion.scene.get("stabilizers.head_damping") or {}).values()))


_CARD = {line.key: line.measure for line in LINES}
# Units: what a search changes in some minutes. States first, because all else depends on them.
TERMS: Mapping[str, Term] = {
    "order": Term(lambda m: float(np.mean([similarity(step) for step in m.orders])), ONE, 0.1, 2.5),
    "in_order": Term(_CARD["in_order"], ONE, 0.25),
    "time_in_15": Term(_CARD["time_in_15"], Limit(21.0), 10.0),
    "swap_from_14": Term(_CARD["swap_from_14"], ONE, 0.5),
    "free_foot_in_air": Term(_CARD["free_foot_in_air"], Limit(0.505), 0.06),
    "landing_toe": Term(measures.landing_toe, Limit(0.5), 8.0),
    "deepest_toe": Term(_CARD["deepest_toe"], Limit(-4.5), 8.0),
    "sole": Term(_CARD["sole"], Limit(0.22, 0.28), 0.02),
    "target_height": Term(_CARD["target_height"], Limit(at_most=1.72), 0.03),
    "target_ahead": Term(_CARD["target_ahead"], Limit(at_most=0.5), 0.1),
    "largest_pull": Term(_CARD["largest_pull"], Limit(at_most=2.9), 1.5, human=Limit(at_most=1.9)),
    # The paper's controller has no damping of the head.
    "head_damping": Term(damping, Limit(at_most=0.0), 10.0),
    "knees_backward": Term(_CARD["knees_backward"], Limit(at_most=0.0), 0.04),
    "ankle_torque": Term(_CARD["ankle_torque"], Limit(), 200.0, human=Limit(at_most=350.0)),
    "largest_lift": Term(_CARD["largest_lift"], Limit(), 1.0, human=Limit(at_most=1.0)),
}
# With tau8.
ARMS = Term(arms, Limit(at_most=-0.75), 0.1)
# Score of a term without a value, in units.
_UNDEFINED = 20.0


def distance(value: float, limit: Limit) -> float:
    """Distance of a value from a range; 0 inside."""
    return max(0.0, limit.at_least - value, value - limit.at_most)


def terms(motion: Motion, human: bool) -> dict[str, float]:
    """Distances from the limits in units, by name of the term."""
    chosen = dict(TERMS)
    if motion.scene.get("control.arm_swing"):
        chosen["arms"] = ARMS
    found = {}
    for name, term in chosen.items():
        value = term.measure(motion) if motion.orders else np.nan
        far = _UNDEFINED if np.isnan(value) else distance(value, term.limit(human)) / term.unit
        found[name] = far
    return found


def run(scene: Scene, steps: int, sigma: float, seed: int) -> Motion:
    """Simulate ``steps`` steps from a start perturbed by ``sigma``, see `Simulator.perturb`.

    Raises
    ------
    ValueError
        If the scene or its start is invalid.
    """
    sim = Simulator(replace(scene, {"control.action_period": SAMPLE_PERIOD}))
    sim.perturb(sigma, seed)
    return skate(sim, steps)


def score(motion: Motion, weights: Mapping[str, float], human: bool) -> float:
    """Score a motion; ``weights`` are factors on the terms' own."""
    total = sum(
        weights.get(name, 1.0) * TERMS.get(name, ARMS).weight * far
        for name, far in terms(motion, human).items()
    )
    return motion.asked - 1 - len(motion.orders) + total / (1.0 + total)
