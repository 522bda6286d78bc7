"""What is required of a step."""

from dataclasses import dataclass

INFINITE = 1e4


@dataclass(frozen=True)
class Limits:
    """Requirements of a solution, and the numbers of the collocation."""

    load: float = 35.0
    """Smallest force of an end of a sole that is on the ice [N]."""
    support: float = 150.0
    """Smallest force of the supporting foot in states 3, 7 and 15 [N]."""
    residual: float = 140.0
    """Largest residual torque [N m]."""
    ankle: float = 100.0
    """Largest residual torque of the free ankle [N m]."""
    total: float = 345.0
    """Largest torque of a joint [N m]."""
    lift: float = 620.0
    """Largest vertical force of the lifting [N]; a body weight is 628 N. Infinite: no limit."""
    landing: tuple[float, float] = (0.15, 0.4)
    """Smallest and largest speed of an end that lands [m/s]."""
    slip: float = 0.1
    """Smallest forward velocity of a sliding foot [m/s]."""
    hold: float = 40.0
    """Smallest force of an end on the ice where the torques change at a sample [N]."""
    speed: float = 1.0
    """Smallest mean speed [m/s]."""
    clearance: float = 0.01
    """Smallest height of the free foot in the middle of state 3 [m]."""
    air: float = 0.507
    """Smallest part of the step with the free foot in the air; 0: no limit."""
    double: float = 0.035
    """Smallest time in states 7 to 14 [s]."""
    shortest: tuple[float, float, float, float, float] = (0.1, 0.015, 0.02, 0.02, 0.03)
    """Smallest durations of the phases [s]."""
    stiffness: float = 7e3
    """Largest K_z [N/m]."""
    ahead: float = 0.5
    """Largest distance of the head's target from the supporting ankle [m]."""
    height: float = 1.75
    """Largest height of the target [m]."""
    smoothness: float = 3e-3
    """Weight of the torques' changes."""
    intervals: tuple[int, int, int, int, int] = (12, 2, 9, 5, 7)
    """Number of intervals of the collocation in each phase."""
    iterations: int = 200
    """Largest number of iterations of IPOPT."""
    barrier: float = 0.005
    """Initial parameter of its barrier."""
    target: float = 0.0
    """Last parameter of its barrier; solutions keep away from the limits if it is not zero."""
