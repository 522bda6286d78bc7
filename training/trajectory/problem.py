"""Direct collocation of one step of the gait on push-only ice (Radau, three points).

The unknowns are durations, motion, contact forces, residual torques and the parameters of the
visual lifting. A phase begins with a landing (impact without restitution), the rotation of the
supporting foot, or its stop. After the last phase the supporting toe lifts off, the legs swap, and
the mirrored state is that of the beginning.
"""

from typing import Any

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from skate_env import Simulator

from .dynamics import MU_BACKWARD, MU_FORWARD, NORMAL, PARAMETERS, PHASES, Dynamics, Phase, swapped
from .engine import scene_of
from .limits import INFINITE, Limits
from .nlp import Nlp
from .robot import Robot
from .solution import DEGREE, POINTS, Solution

Array = NDArray[np.float64]

# Range of the joint angles q2 to q17 and of the foot's q1 [rad].
_LOWEST = [-1.5, -1.2, 0.0, -2.2, -2.2, -2.4, -1.0, -0.5, -0.6, -0.3]
_LOWEST += [-1.5, -2.0, -0.8, -1.5, -2.0, -0.8, -0.8]
_HIGHEST = [1.0, 1.0, 2.4, 2.2, 2.2, 0.0, 1.2, 0.5, 0.8, 0.3]
_HIGHEST += [1.5, 2.0, 0.8, 1.5, 2.0, 0.8, 0.8]
_STATE_LOW = np.array([-1.0, -0.5, *_LOWEST, *[-60.0] * 19])
_STATE_HIGH = np.array([10.0, 1.0, *_HIGHEST, *[60.0] * 19])
_STATE_SIZE = np.array([0.3] * 19 + [3.0] * 19)
_PARAMETER_SIZE = (300.0, 1000.0, 0.3, 1.0)
# Weights of the contact forces [1/(100 N)2] and of the joint rates [s2/rad2] in the cost.
_FORCE_WEIGHT, _RATE_WEIGHT = 1e-5, 1e-5
# Part of the friction cone that the fixed toe may use.
_CONE = 0.9
_LARGEST_FORCE, _LARGEST_IMPULSE = 6000.0, 300.0
# Printed torques before and after the samples of the controller at the beginning of a phase, of
# which each must keep the ends on the ice with the other's residual torque.
_SAMPLES = {7: ("swing", "landing"), 15: ("landing", None), 16: ("push",)}


class Problem:
    """The nonlinear program of one step."""

    def __init__(self, robot: Robot, limits: Limits, guess: Solution) -> None:
        """Build the program; foot and factor of the feedforward are those of the guess."""
        self.limits, self.guess = limits, guess
        self.robot, self.dynamics = robot, Dynamics(robot, guess.scale)
        self.nlp = nlp = Nlp()
        largest = [4000.0, limits.stiffness, limits.ahead, limits.height]
        lowest = [0.0, 0.0, 0.0, 1.4]
        self.parameters = nlp.variable(guess.parameters, lowest, largest, _PARAMETER_SIZE)
        self.durations = nlp.variable(guess.durations, limits.shortest, 0.6, 0.05)
        self.start = self._state(guess.start)
        self.states: list[list[Any]] = []
        self.forces: list[list[Any]] = []
        self.torques: list[list[Any]] = []
        state = self.start
        for number, phase in enumerate(PHASES):
            state = self._begin(number, phase, state)
            state = self._phase(number, phase, state)
        self._close(state)

    def solve(self, show: bool) -> tuple[Solution, str, float]:
        """Solve; return the step, IPOPT's status and the largest violation of a constraint."""
        limits = self.limits
        barrier = (limits.barrier, limits.target)
        value, status, violation = self.nlp.solve(limits.iterations, barrier, show)

        def series(columns: list[list[Any]]) -> list[Array]:
            return [value(ca.horzcat(*each)) for each in columns]

        found = Solution(
            durations=value(self.durations),
            parameters=value(self.parameters),
            start=value(self.start),
            foot=self.guess.foot,
            scale=self.guess.scale,
            states=series(self.states),
            forces=series(self.forces),
            torques=series(self.torques),
        )
        return found, status, violation

    def _state(self, guess: Array) -> Any:
        return self.nlp.variable(guess, _STATE_LOW, _STATE_HIGH, _STATE_SIZE)

    def _force(self, phase: Phase, guess: Array, least: float, largest: float, size: float) -> Any:
        """Add lam; normal forces are zero at ends in the air."""
        low, high = np.full((2, 6), largest) * [[-1.0], [1.0]]
        for end, i in zip(phase.ends, NORMAL, strict=True):
            low[i], high[i] = (least, largest) if end else (0.0, 0.0)
        return self.nlp.variable(guess, low, high, size)

    def _torque(self, guess: Array) -> Any:
        largest = np.full(16, self.limits.residual)
        largest[5] = self.limits.ankle
        return self.nlp.variable(guess, -largest, largest, 50.0)

    def _begin(self, number: int, phase: Phase, state: Any) -> Any:
        """Add the event with which a phase begins; return the state after it."""
        nlp, robot = self.nlp, self.robot
        if number == 0:
            return state
        q, v = state[:19], state[19:]
        if phase.fixed:
            nlp.constrain(robot.end_velocities(q, v)[1, 0])
            return state
        if phase.law == "push":
            self._samples(number, phase, q, v)
            return state
        guess = self.guess.state(number, 0.0)[19:]
        after = nlp.variable(guess, -60.0, 60.0, 3.0)
        impulse = self._force(phase, np.zeros(6), 0.0, _LARGEST_IMPULSE, 200.0)
        nlp.constrain(self.dynamics.impact(q, v, after, impulse))
        velocities, ends = robot.end_velocities(q, after), robot.ends(q)
        for i in range(4):
            if phase.ends[i]:
                nlp.constrain(velocities[i, 1])
        for foot in (0, 3):
            normal = impulse[foot] + impulse[foot + 1]
            nlp.constrain(impulse[foot + 2] + MU_FORWARD * normal)
        lands = 2 if phase.state == 7 else 3
        nlp.constrain(ends[lands, 1])
        slowest, fastest = self.limits.landing
        nlp.constrain(robot.end_velocities(q, v)[lands, 1], -fastest, -slowest)
        self._samples(number, phase, q, after)
        return ca.vertcat(q, after)

    def _samples(self, number: int, phase: Phase, q: Any, v: Any) -> None:
        """Keep the ends on the ice where the torques change at a sample of the controller."""
        torque = self.torques[number - 1][-1]
        guess = self.guess.force(number, 0.0)
        for law in _SAMPLES[phase.state]:
            before = law == PHASES[number - 1].law
            time = self.durations[number - 1] if before else 0.0
            a = self.nlp.variable(np.zeros(19), -5000.0, 5000.0, 50.0)
            lam = self._force(phase, guess, self.limits.hold, _LARGEST_FORCE, 200.0)
            equations = self.dynamics.equations(phase, law)
            zero, _ = equations(q, v, a, lam, torque, time, self.parameters)
            self.nlp.constrain(zero)

    def _phase(self, number: int, phase: Phase, state: Any) -> Any:
        """Add the collocation of a phase; return its last state."""
        guess, limits = self.guess, self.limits
        n = limits.intervals[number]
        duration = self.durations[number]
        step = duration / n
        since = self.durations[number - 1] if phase.fixed else 0.0
        torques = [self._torque(guess.torque(number, i / n)) for i in range(n + 1)]
        self.states.append([])
        self.forces.append([])
        self.torques.append(torques)
        for i in range(n):
            places = (i + POINTS) / n
            states = [self._state(guess.state(number, place)) for place in places]
            forces = []
            for j, place in enumerate(places):
                last = phase.fixed and i == n - 1 and j == DEGREE - 1
                low = 0.0 if last else limits.load
                lam = self._force(phase, guess.force(number, place), low, _LARGEST_FORCE, 200.0)
                forces.append(lam)
            rates = _rates(state, states)
            # The foot comes to rest at the end of state 16.
            slip = 0.0 if phase.state == 16 and i == n - 1 else limits.slip
            for j, place in enumerate(places):
                torque = torques[i] + (torques[i + 1] - torques[i]) * POINTS[j]
                time = since + duration * place
                self._point(phase, states[j], rates[j] / step, forces[j], torque, time, slip)
                self.nlp.cost += _WEIGHTS[j] * step * self._cost(states[j], forces[j], torque)
            change = ca.sumsqr((torques[i + 1] - torques[i]) / 100.0)
            self.nlp.cost += limits.smoothness * change
            self.states[-1] += states
            self.forces[-1] += forces
            state = states[-1]
        if number == 0:
            middle = self.robot.ends(self.states[0][n // 2 * DEGREE + DEGREE - 1][:19])
            self.nlp.constrain(middle[2:, 1], limits.clearance, 1.0)
        return state

    def _point(
        self, phase: Phase, x: Any, rate: Any, lam: Any, torque: Any, time: Any, slip: float
    ) -> None:
        """Add the equations of motion and the limits at a point of collocation."""
        nlp, limits, robot = self.nlp, self.limits, self.robot
        q, v = x[:19], x[19:]
        nlp.constrain((rate[:19] - v) * self._step(phase))
        equations = self.dynamics.equations(phase, phase.law)
        zero, total = equations(q, v, rate[19:], lam, torque, time, self.parameters)
        nlp.constrain(zero)
        nlp.constrain(total, -limits.total, limits.total)
        if np.isfinite(limits.lift):
            lift = self.parameters[1] * (self.parameters[3] - robot.head(q)[2])
            nlp.constrain(lift / 100.0, -INFINITE / 100.0, limits.lift / 100.0)
        ends, velocities = robot.ends(q), robot.end_velocities(q, v)
        for i in range(4):
            if not phase.ends[i]:
                nlp.constrain(ends[i, 1], 0.0, 5.0)
        if phase.ends[0]:
            nlp.constrain(lam[0] + lam[1], limits.support, INFINITE)
        if phase.ends[2]:
            nlp.constrain(velocities[2, 0], limits.slip, 20.0)
        if phase.fixed:
            nlp.constrain(lam[2] + _CONE * MU_FORWARD * lam[1], 0.0, INFINITE)
            nlp.constrain(_CONE * MU_BACKWARD * lam[1] - lam[2], 0.0, INFINITE)
        else:
            nlp.constrain(velocities[1, 0], slip, 20.0)

    def _cost(self, x: Any, lam: Any, torque: Any) -> Any:
        effort, load = ca.sumsqr(torque / 100.0), ca.sumsqr(lam / 100.0)
        return effort + _FORCE_WEIGHT * load + _RATE_WEIGHT * ca.sumsqr(x[21:])

    def _step(self, phase: Phase) -> Any:
        number = PHASES.index(phase)
        return self.durations[number] / self.limits.intervals[number]

    def _close(self, state: Any) -> None:
        """Add lift-off, swap and mirror, and what a step must do."""
        nlp, limits, robot = self.nlp, self.limits, self.robot
        q, v = state[:19], state[19:]
        nlp.constrain(self.forces[-1][-1][1])
        ends, velocities = robot.ends(q), robot.end_velocities(q, v)
        nlp.constrain(swapped([0.0, 0.0, 0.0], q) - self.start[:19])
        nlp.constrain(swapped([velocities[3, 0], 0.0, 0.0], v) - self.start[19:])
        total = ca.sum1(self.durations)
        nlp.constrain(ends[3, 0] - limits.speed * total, 0.0, 10.0)
        nlp.constrain(total - self.durations[0], limits.double, 1.0)
        if limits.air > 0.0:
            nlp.constrain(self.durations[0] - limits.air * total, 0.0, 1.0)
        nlp.cost /= total


def solve(limits: Limits, guess: Solution, show: bool = False) -> tuple[Solution, str, float]:
    """Solve from a guess, with its foot and feedforward; results as those of `Problem.solve`."""
    scene = scene_of(guess)
    robot = Robot(Simulator(scene), guess.foot, scene.parameters()["body.head.length"][0])
    return Problem(robot, limits, guess).solve(show)


def _rates(first: Any, states: list[Any]) -> list[Any]:
    """Return the polynomial's derivatives at the points, times the interval's length."""
    nodes = [first, *states]
    return [sum(_SLOPES[r, j] * nodes[r] for r in range(DEGREE + 1)) for j in range(DEGREE)]


_SLOPES, _WEIGHTS = (np.array(each) for each in ca.collocation_coeff(list(POINTS))[::2])
_WEIGHTS = _WEIGHTS.ravel()
assert len(PARAMETERS) == len(_PARAMETER_SIZE)
