"""MuJoCo's settings and models for the motions of the study."""

from dataclasses import dataclass
from importlib import import_module
from typing import Any
from xml.etree import ElementTree as ET

from ...scenes import to_mjcf
from .cases import Case

PYRAMIDAL, ELLIPTIC = "pyramidal", "elliptic"
# Radius of the contact spheres [m]; the engine's soles have point contacts.
_RADIUS = 1e-12


@dataclass(frozen=True)
class Contact:
    """Stiffness and damping of a contact, and MuJoCo's options for its forces.

    With a stiffness, stiffness and damping scale with the timestep h, and the contact becomes rigid
    for h -> 0. Without, the contact is the same at every timestep.
    """

    label: str
    """Name in legends."""
    stiffness: float | None = None
    """Normal stiffness [1/h^2]; None for MuJoCo's default, a time constant of 20 ms."""
    damping: float = 1.0
    """Normal damping [1/h]; with pyramidal cones the tangential damping as well."""
    tangential_damping: float | None = None
    """Tangential damping at h = 1 ms [1/h]; None for the normal one."""
    tangential_exponent: float = 1.0
    """Exponent of 1/h with which the tangential damping rate grows."""
    impedance: tuple[float, float] = (0.9, 0.95)
    """Impedance at first contact and 1 mm deeper: MuJoCo's `solimp`."""
    ratio: float = 1.0
    """Ratio of tangential to normal impedance: MuJoCo's `impratio`."""
    solver: str = "Newton"
    islands: bool = True
    """Whether independent groups of bodies are solved separately."""
    speculative: bool = False
    """Whether contacts are detected before they close (MuJoCo 4.0 or newer)."""


# The contacts below are the best of some 30,000 runs with random stiffness, damping, impedance and
# ratio, both cones and all integrators of MuJoCo 4.0. Errors are those of the final coordinates
# [rad, m] over four starts, fewer in the last column.
#
# MuJoCo's friction cone is convex: sliding at v pushes the foot off the ice like mu v times the
# tangential damping, and contact ends at the first gap. A foot that the contact stops within a step
# (`stiff`) therefore bounces: its slide distance is 0.07 m of 0.25 m too short, at 1 ms and at
# 0.16 ms. Lower tangential damping avoids this; only elliptic cones can have it
# (`solreffriction`). Lower impedance keeps the foot in contact. Lower values of both are better at
# long steps and creep more at short ones, where a normal stiffness that is too large bounces (1.8).
#
#   slide, Euler, h [ms]   1.25    0.31    0.16    0.078   0.039   0.0098  0.0049
#   default                0.37    0.087   0.036   0.012   0.0053  0.0028
#   stiff                  0.28    0.23    0.22    0.017   0.0023  0.0080
#   gliding coarse         0.0022  4.8e-4  2.6e-4  1.4e-4  7.6e-5  1.8
#   gliding                0.0031  5.5e-4  2.5e-4  1.3e-4  6.9e-5  2.1e-5  0.23
#   gliding fine           0.014   0.0020  7.3e-4  1.9e-4  4.0e-5  1.2e-5  5.0e-6
#
# The impact of a landing foot is short, so its tangential damping grows with 1/h.
#
#   landing, h [ms]        1.25    0.31    0.16    0.078   0.039   0.0098  0.0049
#   default, Euler         0.013   0.016   0.017   0.016   0.016   0.016
#   stiff, Euler           0.0018  6.7e-4  6.4e-4  8.7e-4  4.6e-4  0.0014
#   stiff, RK4             0.0013  5.5e-4  5.7e-4  2.0e-4  4.9e-4  3.3e-4
#   firm, Euler            0.0012  2.9e-4  1.4e-4  6.9e-5  3.4e-5  1.6e-5  1.1e-5
#   firm, RK4              0.0011  1.6e-4  7.7e-5  2.4e-5  1.7e-5  3.0e-6  1.1e-6
#
# Speculative contacts halve the errors of `landing` and do not change `slide`. Changes of less than
# a tenth of an error: noslip iterations, a tolerance of 1e-14, PGS (slower), no warm starts
# (slower), a sparse Jacobian. A tolerance of 1e-4 saves 5 % of the time and loses a third of the
# accuracy. Exact diagonals make a sliding foot bounce. CG instead of Newton's method takes 0.8 of
# the time on `slide`, no islands 0.95. The integrator `discrete` equals Euler on `landing` and is
# worse on `slide`. `implicitfast` equals Euler, whose joint damping is implicit as well.
CONTACTS: dict[str, Contact] = {
    "default": Contact("default contact"),
    # The usual recommendation for rigid contact: a time constant of two steps, an impedance near 1.
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
    """Integrator, timestep, cone and contact of a MuJoCo run."""

    integrator: str
    """`Euler`, `implicit`, `implicitfast`, `RK4`, or `discrete` (from MuJoCo 3.13 on)."""
    timestep: float
    """[s]"""
    cone: str | None = None
    """`pyramidal` or `elliptic`; None without contact."""
    contact: str | None = None
    """A key of `CONTACTS`."""

    @property
    def method(self) -> str:
        """Everything but the timestep, for legends."""
        if self.cone is None or self.contact is None:
            return self.integrator
        return f"{self.integrator}, {self.cone}, {CONTACTS[self.contact].label}"

    @property
    def label(self) -> str:
        """The timestep as text."""
        return f"{1e3 * self.timestep:.3g} ms"


def package() -> Any:
    """Import MuJoCo; raise ImportError if it is not installed."""
    # Optional dependency.
    return import_module("mujoco")


def load(case: Case, setting: Setting) -> Any:
    """Build MuJoCo's model of a case.

    A foot that is fixed to the ice has no joints. Feet that can touch it have a contact pair for
    every end of a sole.
    """
    mj = package()
    root = ET.fromstring(to_mjcf(case.scene, timestep=setting.timestep, contact=not case.smooth))
    if is_fixed(case):
        foot = root.find(".//body[@name='foot']")
        assert foot is not None
        for joint in foot.findall("joint"):
            foot.remove(joint)
    if not case.smooth:
        _add_contact_points(root)
    model = mj.MjModel.from_xml_string(ET.tostring(root, encoding="unicode"))
    model.opt.integrator = getattr(mj.mjtIntegrator, f"mjINT_{setting.integrator.upper()}")
    if setting.cone is None or setting.contact is None:
        model.opt.disableflags |= mj.mjtDisableBit.mjDSBL_CONTACT
    else:
        model.opt.cone = getattr(mj.mjtCone, f"mjCONE_{setting.cone.upper()}")
        _set_contact(mj, model, CONTACTS[setting.contact], setting.timestep)
    return model


def is_fixed(case: Case) -> bool:
    """Whether the supporting foot is fixed to the ice."""
    effects = case.scene.effects()
    return not (effects["slipping"] or effects["foot_rotation"] or effects["push_only"])


def _add_contact_points(root: ET.Element) -> None:
    ice = root.find(".//geom[@name='ice']")
    assert ice is not None
    coefficient = ice.get("friction", "").split()[0]
    pairs = ET.SubElement(root, "contact")
    for geom in root.iter("geom"):
        if geom.get("type") == "sphere":
            x, y, z = (float(item) for item in geom.get("pos", "").split())
            lowered = z - float(geom.get("size", "0")) + _RADIUS
            geom.set("size", repr(_RADIUS))
            geom.set("pos", f"{x!r} {y!r} {lowered!r}")
            # Only the pairs below collide.
            geom.set("contype", "0")
            friction = f"{coefficient} {coefficient} 0 0 0"
            names = {"geom1": "ice", "geom2": geom.get("name", "")}
            ET.SubElement(pairs, "pair", names, condim="3", friction=friction)


def _set_contact(mj: Any, model: Any, contact: Contact, timestep: float) -> None:
    model.opt.impratio = contact.ratio
    model.opt.solver = getattr(mj.mjtSolver, f"mjSOL_{contact.solver.upper()}")
    model.pair_solimp[:, :2] = contact.impedance
    if contact.stiffness is not None:
        # Negative values are stiffness and damping, positive ones a time constant and a ratio.
        model.pair_solref[:] = -contact.stiffness / timestep**2, -contact.damping / timestep
    if contact.tangential_damping is not None:
        damping = (
            contact.tangential_damping * 1e3 * (1e-3 / timestep) ** contact.tangential_exponent
        )
        model.pair_solreffriction[:] = 0.0, -damping
    # Older versions lack some flags.
    if not contact.islands:
        model.opt.disableflags |= getattr(mj.mjtDisableBit, "mjDSBL_ISLAND", 0)
    if contact.speculative:
        model.opt.enableflags |= getattr(mj.mjtEnableBit, "mjENBL_SPECULATIVE", 0)
