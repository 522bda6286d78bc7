"""What a gait does: its contact states in sequence, times, lengths, forces and torques."""

from .contact_sequence import ORDER, SHORTEST_VISIT, Event, StepOrder, step_orders
from .motion import SAMPLE_PERIOD, Motion, orders_of, skate
from .quantities import QUANTITIES, Quantity

__all__ = [
    "ORDER",
    "QUANTITIES",
    "SAMPLE_PERIOD",
    "SHORTEST_VISIT",
    "Event",
    "Motion",
    "Quantity",
    "StepOrder",
    "orders_of",
    "skate",
    "step_orders",
]
