"""What a gait does: order of its contact states, forces, work, and robustness, as a card."""

from .contact_sequence import ORDER, SHORTEST_VISIT, Event, StepOrder, step_orders
from .line import ONE, Limit
from .motion import ONLY_FIRST, SAMPLE_PERIOD, Motion, skate
from .robustness import SIGMA

__all__ = [
    "ONE",
    "ONLY_FIRST",
    "ORDER",
    "SAMPLE_PERIOD",
    "SHORTEST_VISIT",
    "SIGMA",
    "Event",
    "Limit",
    "Motion",
    "StepOrder",
    "skate",
    "step_orders",
]
