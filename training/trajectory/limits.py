"""What is required of a step, from its first guess to the last solution."""

from dataclasses import dataclass

INFINITE = 1e4


@dataclass(frozen=True)
class Limits:
    """Requirements of one solution.

    Attributes
    ----------
    foot
        Ankle to toe and to heel, and its height [m].
    pull
        Largest tensile force of an end of a sole [N].
    load
        Smallest force of an end of a sole that is on the ice [N].
    support
        Smallest force of the supporting foot in states 3, 7 and 15 [N].
    residual
        Largest residual torque [N m]; `ankle` that of the free ankle.
    total
        Largest torque of a joint [N m].
    landing
        Smallest and largest speed of an end that lands [m/s].
    slip
        Smallest forward velocity of a sliding foot [m/s].
    hold
        Smallest force of an end on the ice [N] where the torques change at a sample of the
        controller; None leaves these instants out.
    speed
        Smallest mean speed [m/s].
    clearance
        Smallest height of the free foot in the middle of state 3 [m].
    double
        Smallest time in states 7 to 14 [s].
    shortest
        Smallest durations of the phases [s].
    stiffness, ahead, height, damping
        Largest K_z [N/m], distance and height of the head's target [m], damping [N s/m].
    smoothness, force
        Weights of the torques' changes and of the contact forces.
    intervals
        Number of intervals of the collocation in each phase.
    iterations, barrier
        Of IPOPT: largest number of iterations, initial parameter of the barrier.
    """

    foot: tuple[float, float, float]
    iterations: int
    barrier: float
    intervals: tuple[int, int, int, int, int] = (9, 4, 4, 3, 5)
    pull: float = 0.0
    load: float = 0.0
    support: float = 0.0
    residual: float = 150.0
    ankle: float = 150.0
    total: float = 500.0
    landing: tuple[float, float] = (0.02, 0.8)
    slip: float = 0.02
    hold: float | None = None
    speed: float = 1.0
    clearance: float = 0.01
    double: float = 0.035
    shortest: tuple[float, float, float, float, float] = (0.05, 0.005, 0.005, 0.004, 0.01)
    stiffness: float = 40e3
    ahead: float = 0.9
    height: float = 1.9
    damping: float = 200.0
    smoothness: float = 1e-3
    force: float = 1e-5


_PAPER, _HUMAN = (0.141889, 0.0513218, 0.07), (0.17, 0.07, 0.07)

_LONG = (0.1, 0.015, 0.02, 0.02, 0.03)
# From the gait of `paper`, where ends pull, to push-only ice; then margins for the engine.
STAGES = (
    Limits(
        _PAPER,
        150,
        0.1,
        pull=8000.0,
        residual=1500.0,
        ankle=1500.0,
        total=3000.0,
        landing=(0.02, 3.0),
        slip=-5.0,
        speed=0.5,
        clearance=-0.1,
        double=0.0,
    ),
    Limits(
        _PAPER,
        100,
        0.01,
        pull=1200.0,
        residual=600.0,
        ankle=600.0,
        total=1500.0,
        landing=(0.02, 2.0),
        slip=-1.0,
        speed=0.7,
        clearance=-0.05,
        double=0.03,
    ),
    Limits(
        _HUMAN,
        100,
        0.01,
        pull=300.0,
        residual=300.0,
        ankle=300.0,
        total=800.0,
        landing=(0.02, 1.5),
        slip=-0.1,
        speed=0.8,
        clearance=-0.01,
        double=0.03,
    ),
    Limits(
        _HUMAN,
        100,
        0.01,
        pull=50.0,
        residual=200.0,
        ankle=200.0,
        landing=(0.02, 1.0),
        slip=0.0,
        clearance=0.0,
        double=0.033,
    ),
    Limits(_HUMAN, 100, 0.01, load=5.0),
    Limits(
        _HUMAN,
        150,
        0.01,
        load=15.0,
        support=60.0,
        ankle=100.0,
        total=450.0,
        slip=0.05,
        stiffness=12e3,
        ahead=0.7,
        height=1.75,
        damping=20.0,
    ),
    Limits(
        _HUMAN,
        150,
        0.01,
        load=25.0,
        support=110.0,
        ankle=100.0,
        total=400.0,
        slip=0.1,
        landing=(0.1, 0.4),
        hold=10.0,
        stiffness=7e3,
        ahead=0.6,
        height=1.75,
        damping=0.0,
        shortest=_LONG,
        smoothness=3e-3,
    ),
    Limits(
        _HUMAN,
        150,
        0.005,
        load=35.0,
        support=150.0,
        ankle=100.0,
        total=400.0,
        slip=0.1,
        landing=(0.15, 0.4),
        hold=40.0,
        stiffness=7e3,
        ahead=0.6,
        height=1.75,
        damping=0.0,
        shortest=_LONG,
        smoothness=3e-3,
    ),
)
