"""The same robot in Drake with CENIC, a convex implicit method with error control.

Kurtz and Castro 2025, arXiv:2511.08771.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from skate_env._core import Scene, Simulator
from skate_env.scenes.mjcf import CONTACT_RADIUS, LINKS, UP

from .bodies import check
from .peers import package

Array = NDArray[np.float64]

_AXES = dict(zip("xyz", np.eye(3), strict=True))
# Axes of the planar joint in the world, by column: y0, z0, and the axis of q1.
_PLANE = np.column_stack([_AXES[axis] for axis in "yzx"])
# Sides of the block of ice [m]. Drake warns about half spaces.
_ICE = np.array([1e3, 1e3, 1.0])


class DrakeRobot:
    """Drake's plant of a scene on isotropic dry ice that only pushes.

    The root has a planar joint. Every end of a sole has a small sphere with Drake's default contact
    (point contact, stiffness, dissipation and speed of stiction). Damping is that of the joints.

    Raises
    ------
    Unavailable
        If Drake is not installed.
    """

    def __init__(self, scene: Scene) -> None:
        self.drake = drake = package("pydrake.all", "drake")
        self._sim = Simulator(scene)
        self._mu = float(scene.get("ice.friction.mu"))
        builder = drake.DiagramBuilder()
        self.plant, graph = drake.AddMultibodyPlantSceneGraph(builder, time_step=0.0)
        # The name that CENIC looks for.
        self.plant.set_name("plant")
        self.plant.set_contact_model(drake.ContactModel.kPoint)
        gravity = -float(scene.get("ice.gravity")) * UP
        self.plant.mutable_gravity_field().set_gravity_vector(gravity)
        joints = self._add_bodies()
        ends = self._add_contact()
        # Feet pass each other.
        without = drake.CollisionFilterDeclaration().ExcludeWithin(drake.GeometrySet(ends))
        graph.collision_filter_manager().Apply(without)
        self.plant.Finalize()
        self.diagram = builder.Build()
        self._q = _places([(joint.position_start(), joint.num_positions()) for joint in joints])
        self._v = _places([(joint.velocity_start(), joint.num_velocities()) for joint in joints])

    def _add_bodies(self) -> list[Any]:
        """Add the bodies; return their joints in the order of our coordinates."""
        drake, plant = self.drake, self.plant
        joints: list[Any] = []
        self._bodies: list[Any] = []
        self._origins: list[Array] = []
        for made in self._sim.bodies():
            (xx, xy, xz), (_, yy, yz), (_, _, zz) = made["inertia"]
            inertia = drake.SpatialInertia.MakeFromCentralInertia(
                made["mass"], made["com"], drake.RotationalInertia(xx, yy, zz, xy, xz, yz)
            )
            body = plant.AddRigidBody(made["name"], inertia)
            name, parent = made["joint"], made["parent"]
            if parent < 0:
                place = drake.RigidTransform(drake.RotationMatrix(_PLANE), made["offset"])
                turned = drake.RigidTransform(drake.RotationMatrix(_PLANE), np.zeros(3))
                frames = self._frame(plant.world_body(), place), self._frame(body, turned)
                joint = drake.PlanarJoint(name, *frames, [0.0, 0.0, made["damping"]])
                origin = np.zeros(3)
            else:
                outer = self._frame(self._bodies[parent], drake.RigidTransform(made["offset"]))
                axis, damping = _AXES[made["axis"]], made["damping"]
                joint = drake.RevoluteJoint(name, outer, body.body_frame(), axis, damping)
                origin = self._origins[parent]
            joints.append(plant.AddJoint(joint))
            self._bodies.append(body)
            self._origins.append(origin + made["offset"])
        return joints

    def _frame(self, body: Any, place: Any) -> Any:
        name = f"frame {self.plant.num_frames()}"
        return self.plant.AddFrame(self.drake.FixedOffsetFrame(name, body.body_frame(), place))

    def _add_contact(self) -> list[Any]:
        """Add the ice and the ends of the soles; return the ends."""
        drake, world = self.drake, self.plant.world_body()
        block = drake.RigidTransform(-0.5 * _ICE[2] * UP)
        self._add_geometry(world, block, drake.Box(*_ICE), "ice")
        segments = self._sim.link_segments(np.zeros(len(self._sim.q)))
        ends = []
        for link, (name, _) in enumerate(LINKS):
            if name != "foot":
                continue
            body, origin = self._bodies[link], self._origins[link]
            for end, point in zip(("heel", "toe"), segments[link], strict=True):
                place = drake.RigidTransform(point - origin + CONTACT_RADIUS * UP)
                sphere = drake.Sphere(CONTACT_RADIUS)
                ends.append(self._add_geometry(body, place, sphere, f"{end}{link + 1}"))
        return ends

    def _add_geometry(self, body: Any, place: Any, shape: Any, name: str) -> Any:
        friction = self.drake.CoulombFriction(self._mu, self._mu)
        return self.plant.RegisterCollisionGeometry(body, place, shape, name, friction)

    def set_state(self, context: Any, q: Array, v: Array) -> None:
        """Set time zero and our coordinates and velocities (n,)."""
        context.SetTime(0.0)
        own = self.plant.GetMyMutableContextFromRoot(context)
        self.plant.SetPositions(own, q[np.argsort(self._q)])
        self.plant.SetVelocities(own, v[np.argsort(self._v)])

    def q(self, context: Any) -> Array:
        """Return our coordinates (n,)."""
        own = self.plant.GetMyContextFromRoot(context)
        return np.asarray(self.plant.GetPositions(own)[self._q])

    def check(self, sim: Simulator) -> None:
        """Raise RuntimeError if mass matrix or bias forces differ in a simulator's state."""
        context, plant = self.diagram.CreateDefaultContext(), self.plant
        self.set_state(context, sim.q, sim.v)
        own = plant.GetMyContextFromRoot(context)
        inertia = plant.CalcMassMatrix(own)[np.ix_(self._v, self._v)]
        bias = plant.CalcBiasTerm(own) - plant.CalcGravityGeneralizedForces(own)
        check(sim, "Drake", inertia, bias[self._v])


class CenicMotion:
    """A motion from a start, with CENIC at an accuracy."""

    def __init__(self, robot: DrakeRobot, q: Array, v: Array, accuracy: float) -> None:
        self._robot, self._start = robot, (q, v)
        drake = robot.drake
        self._context = robot.diagram.CreateDefaultContext()
        self._simulator = drake.Simulator(robot.diagram, self._context)
        self._config = drake.SimulatorConfig(integration_scheme="cenic", accuracy=accuracy)
        self.restart()

    def restart(self) -> None:
        """Return to the start, with a new integrator: `Initialize` alone gives other steps."""
        self._robot.set_state(self._context, *self._start)
        self._robot.drake.ApplySimulatorConfig(self._config, self._simulator)
        self._simulator.Initialize()

    def advance(self, until: float) -> None:
        """Advance to a time [s]."""
        self._simulator.AdvanceTo(until)

    @property
    def q(self) -> Array:
        """Coordinates (n,)."""
        return self._robot.q(self._context)


def _places(parts: list[tuple[int, int]]) -> NDArray[np.intp]:
    """Join ranges of (start, length)."""
    return np.concatenate([np.arange(start, start + length) for start, length in parts])
