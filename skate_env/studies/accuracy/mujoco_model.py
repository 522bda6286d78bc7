"""MuJoCo's settings, and its models of the study's motions."""

from dataclasses import dataclass
from importlib import import_module
from typing import Any
from xml.etree import ElementTree as ET

from ...mjcf import to_mjcf
from .cases import Case

PYRAMIDAL, ELLIPTIC = "pyramidal", "elliptic"
# Soles touch the ice with points, as ours do, though MuJoCo's spheres need some radius [m].
_POINT = 1e-12


@dataclass(frozen=True)
class Contact:
    """How hard a contact is, and how MuJoCo solves for its forces.

    Where a stiffness is given, stiffness and dampings follow the timestep h, and contact becomes
    rigid as h goes to 0; else it is the same at every timestep.
    """

    label: str
    """For legends."""
    stiffness: float | None = None
    """Across the ice, in 1/h^2; None for MuJoCo's own: a time constant of 20 ms."""
    damping: float = 1.0
    """Across the ice, in 1/h; pyramids have it along the ice too."""
    rubbing: float | None = None
    """Damping along the ice at h = 1 ms, in 1/h; None for the same as across it."""
    rubbing_power: float = 1.0
    """How `rubbing` as a rate grows with 1/h."""
    impedance: tuple[float, float] = (0.9, 0.95)
    """Where it begins to touch, and 1 mm deeper: MuJoCo's `solimp`."""
    ratio: float = 1.0
    """Of the impedances along and across the ice: MuJoCo's `impratio`."""
    solver: str = "Newton"
    islands: bool = True
    """Look for groups of bodies that can be solved for on their own."""
    speculative: bool = False
    """See contacts before they close (from MuJoCo 4.0 on)."""


# What follows is the best of some 30,000 runs with random stiffness, dampings, impedance and ratio,
# both cones and all integrators of MuJoCo 4.0. Errors are those of the coordinates at the end
# (rad, m), over four starts, fewer in the last column.
#
# MuJoCo's cone is convex: a foot that slides at v is pushed off the ice as by mu v times the
# damping along the ice, and contact ends as soon as there is a gap. A foot whose contact stops it
# within a step (`stiff`) therefore hops: it slides too short by 0.07 m of 0.25 m, at 1 ms as at
# 0.16 ms. Less damping along the ice cures this, which only elliptic cones allow for
# (`solreffriction`), and less impedance keeps the foot pressed into the ice. Less of either is
# better at long steps, and leaves more creep at short ones; too stiff a normal hops there (1.8).
#
#   slide, Euler, h [ms]   1.25    0.31    0.16    0.078   0.039   0.0098  0.0049
#   default                0.37    0.087   0.036   0.012   0.0053  0.0028
#   stiff                  0.28    0.23    0.22    0.017   0.0023  0.0080
#   gliding coarse         0.0022  4.8e-4  2.6e-4  1.4e-4  7.6e-5  1.8
#   gliding                0.0031  5.5e-4  2.5e-4  1.3e-4  6.9e-5  2.1e-5  0.23
#   gliding fine           0.014   0.0020  7.3e-4  1.9e-4  4.0e-5  1.2e-5  5.0e-6
#
# A landing foot is stopped at once, so there the damping along the ice grows with 1/h.
#
#   landing, h [ms]        1.25    0.31    0.16    0.078   0.039   0.0098  0.0049
#   default, Euler         0.013   0.016   0.017   0.016   0.016   0.016
#   stiff, Euler           0.0018  6.7e-4  6.4e-4  8.7e-4  4.6e-4  0.0014
#   stiff, RK4             0.0013  5.5e-4  5.7e-4  2.0e-4  4.9e-4  3.3e-4
#   firm, Euler            0.0012  2.9e-4  1.4e-4  6.9e-5  3.4e-5  1.6e-5  1.1e-5
#   firm, RK4              0.0011  1.6e-4  7.7e-5  2.4e-5  1.7e-5  3.0e-6  1.1e-6
#
# Seeing contacts ahead halves the errors of landing, and changes nothing for a foot that slides.
# None of these changes more than a tenth of an error: noslip iterations, a tolerance of 1e-14, PGS
# (slower), no warm starts (slower), a sparse Jacobian. A tolerance of 1e-4 saves a twentieth of
# the time and costs a third of the accuracy; exact diagonals make a sliding foot hop. CG instead
# of Newton's method takes 0.8 of the time on `slide`; no islands, 0.95. The integrator `discrete`
# is as good as Euler's on `landing` and worse on `slide`; `implicitfast` is the same as Euler's,
# whose joint damping is implicit too.
CONTACTS: dict[str, Contact] = {
    "default": Contact("default contact"),
    # The usual advice for rigid contact: a time constant of two steps, and hardly any softness.
    "stiff": Contact("stiff", 0.25, 1.0, impedance=(0.9999, 0.9999)),
    "gliding coarse": Contact(
        "gliding coarse", 1.0, 0.45, 0.013, 0.5, (0.5, 0.5), 1000.0, solver="CG", islands=False
    ),
    "gliding": Contact(
        "gliding", 0.6, 0.45, 0.013, 0.5, (0.5, 0.5), 1000.0, solver="CG", islands=False
    ),
    "gliding fine": Contact(
        "gliding fine", 0.3, 0.6, 0.03, 0.5, (0.5, 0.5), 1000.0, solver="CG", islands=False
    ),
    "firm": Contact(
        "firm", 0.05, 1.1, 0.45, 1.0, (0.95, 0.95), 30.0, islands=False, speculative=True
    ),
}


@dataclass(frozen=True)
class Setting:
    """What MuJoCo is told."""

    integrator: str
    """`Euler`, `implicit`, `implicitfast`, `RK4`, or `discrete` (from MuJoCo 3.13 on)."""
    timestep: float
    """[s]"""
    cone: str | None = None
    """`pyramidal` or `elliptic`; None where nothing touches."""
    contact: str | None = None
    """A key of `CONTACTS`."""

    @property
    def method(self) -> str:
        """All but the timestep, for legends."""
        if self.cone is None or self.contact is None:
            return self.integrator
        return f"{self.integrator}, {self.cone}, {CONTACTS[self.contact].label}"

    @property
    def label(self) -> str:
        """The timestep, for people."""
        return f"{1e3 * self.timestep:.3g} ms"


def package() -> Any:
    """Import MuJoCo; ImportError where it is not installed."""
    # An extra of the tests; without it the package works.
    return import_module("mujoco")


def load(case: Case, setting: Setting) -> Any:
    """Make MuJoCo's model of a case.

    A foot that is fixed to the ice loses its joints; feet that may touch it get a pair of geoms
    for every end of a sole.
    """
    mj = package()
    root = ET.fromstring(to_mjcf(case.scene, timestep=setting.timestep, contact=not case.smooth))
    if is_fixed(case):
        foot = root.find(".//body[@name='foot']")
        assert foot is not None
        for joint in foot.findall("joint"):
            foot.remove(joint)
    if not case.smooth:
        _touch_with_points(root)
    model = mj.MjModel.from_xml_string(ET.tostring(root, encoding="unicode"))
    model.opt.integrator = getattr(mj.mjtIntegrator, f"mjINT_{setting.integrator.upper()}")
    if setting.cone is None or setting.contact is None:
        model.opt.disableflags |= mj.mjtDisableBit.mjDSBL_CONTACT
    else:
        model.opt.cone = getattr(mj.mjtCone, f"mjCONE_{setting.cone.upper()}")
        _harden(mj, model, CONTACTS[setting.contact], setting.timestep)
    return model


def is_fixed(case: Case) -> bool:
    """Say whether the supporting foot never moves."""
    effects = case.scene.effects()
    return not (effects["slipping"] or effects["foot_rotation"] or effects["push_only"])


def _touch_with_points(root: ET.Element) -> None:
    ice = root.find(".//geom[@name='ice']")
    assert ice is not None
    coefficient = ice.get("friction", "").split()[0]
    pairs = ET.SubElement(root, "contact")
    for geom in root.iter("geom"):
        if geom.get("type") == "sphere":
            x, y, z = (float(item) for item in geom.get("pos", "").split())
            lowered = z - float(geom.get("size", "0")) + _POINT
            geom.set("size", repr(_POINT))
            geom.set("pos", f"{x!r} {y!r} {lowered!r}")
            # The pairs below are all that may touch.
            geom.set("contype", "0")
            friction = f"{coefficient} {coefficient} 0 0 0"
            names = {"geom1": "ice", "geom2": geom.get("name", "")}
            ET.SubElement(pairs, "pair", names, condim="3", friction=friction)


def _harden(mj: Any, model: Any, contact: Contact, timestep: float) -> None:
    model.opt.impratio = contact.ratio
    model.opt.solver = getattr(mj.mjtSolver, f"mjSOL_{contact.solver.upper()}")
    model.pair_solimp[:, :2] = contact.impedance
    if contact.stiffness is not None:
        # Negative numbers are stiffness and damping themselves.
        model.pair_solref[:] = -contact.stiffness / timestep**2, -contact.damping / timestep
    if contact.rubbing is not None:
        damping = contact.rubbing * 1e3 * (1e-3 / timestep) ** contact.rubbing_power
        model.pair_solreffriction[:] = 0.0, -damping
    # Older versions have fewer flags.
    if not contact.islands:
        model.opt.disableflags |= getattr(mj.mjtDisableBit, "mjDSBL_ISLAND", 0)
    if contact.speculative:
        model.opt.enableflags |= getattr(mj.mjtEnableBit, "mjENBL_SPECULATIVE", 0)
