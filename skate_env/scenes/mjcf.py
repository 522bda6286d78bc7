"""Export of the robot to MJCF, with the same bodies, joints and inertias."""

import re
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any
from xml.etree import ElementTree as ET

import numpy as np
from numpy.typing import NDArray

from .._core import Simulator
from ..common import between
from .loading import SceneSource, as_scene

Array = NDArray[np.float64]

UP = np.array([0.0, 0.0, 1.0])
AXES = {"x": "1 0 0", "y": "0 1 0", "z": "0 0 1"}

# Links 1 to 17 of the paper: name in a scene's table `body`, and number of the parent link.
LINKS = (
    ("foot", 0),
    ("lower_leg", 1),
    ("upper_leg", 2),
    ("waist", 3),
    ("upper_leg", 4),
    ("lower_leg", 5),
    ("foot", 6),
    ("lower_body", 4),
    ("middle_body", 8),
    ("upper_body", 9),
    ("upper_arm", 10),
    ("lower_arm", 11),
    ("hand", 12),
    ("upper_arm", 10),
    ("lower_arm", 14),
    ("hand", 15),
    ("head", 10),
)

# Radius of the spheres that touch the ice at heel and toe [m].
CONTACT_RADIUS = 0.001
# Characters that a scene's name may have, and XML may not.
_NOT_XML = re.compile("[\ufffe\uffff]")
# Coefficient of friction for feet that never slide.
STICKING = 10.0


def to_mjcf(scene: SceneSource, *, timestep: float = 0.001, contact: bool = False) -> str:
    """Write the robot of a scene as a MuJoCo model.

    The joints have the names and the order of `Simulator.coordinate_names`, so that MuJoCo's
    `qpos` and `qvel` are `q` and `v` in every contact state. The legs keep the sides that they have
    at the start. Masses and inertias are those of the scene; the geoms only show the rods and the
    soles they belong to. There is no controller: apply torques through `qfrc_applied`.

    Parameters
    ----------
    scene
        A `Scene`, a preset's name, or the path of a scene file. The robot stands on the leg that
        supports it at the start; locked joints are merged.
    timestep
        MuJoCo's step [s], 1e-6 to 1.
    contact
        Whether heels and toes have contact with the ice. MuJoCo's friction does not depend on the
        sliding direction: the ice has the coefficient for sliding forward, none without dry
        friction, and `STICKING` for sticking feet.

    Returns
    -------
    str
        The MJCF document, in SI units and rad.

    Raises
    ------
    TypeError, ValueError
        If the scene does not exist or has no valid start, or the time step is out of range.
    OSError
        If the file cannot be read.

    Examples
    --------
    >>> import skate_env
    >>> skate_env.to_mjcf("paper").startswith("<mujoco")
    True
    """
    timestep = between("timestep", timestep, 1e-6, 1.0)
    scene = as_scene(scene)
    simulator = Simulator(scene)
    ice = scene.get("ice")

    root = ET.Element("mujoco", model=_NOT_XML.sub("_", scene.name))
    # The compiler must not modify masses and inertias.
    ET.SubElement(
        root,
        "compiler",
        angle="radian",
        autolimits="false",
        balanceinertia="false",
        boundinertia="0",
        boundmass="0",
        inertiafromgeom="false",
    )
    gravity = _numbers([0.0, 0.0, -ice["gravity"]])
    ET.SubElement(root, "option", timestep=_numbers([timestep]), gravity=gravity)
    default = ET.SubElement(root, "default")
    ET.SubElement(default, "geom", contype="0", conaffinity="0", mass="0", rgba="0.5 0.6 0.7 1")

    world = ET.SubElement(root, "worldbody")
    ET.SubElement(world, "light", pos="0 0 4", dir="0 0 -1", directional="true")
    floor = ET.SubElement(world, "geom", name="ice", type="plane", size="0 0 1", rgba="0.8 0.9 1 1")
    if contact:
        floor.set("conaffinity", "1")
        # With priority, the ice sets the friction of every pair.
        floor.set("priority", "1")
        floor.set("friction", _numbers([_coefficient(ice["friction"]), 0.0, 0.0]))

    hosts = _add_bodies(world, simulator)
    segments = simulator.link_segments(np.zeros(len(simulator.coordinate_names)))
    _add_links(hosts, segments, scene.get("body"), contact)

    ET.indent(root)
    return ET.tostring(root, encoding="unicode")


def _coefficient(friction: dict[str, Any]) -> float:
    """Return the friction coefficient for sliding forward from a scene's `ice.friction`."""
    if friction["kind"] == "sticking":
        return STICKING
    return float(friction.get("mu_forward", friction.get("mu", 0.0)))


@dataclass
class Host:
    """A body that carries links."""

    element: ET.Element
    origin: Array
    """Origin of its frame in the world at q = 0 [m], where all frames are parallel."""


def _add_bodies(world: ET.Element, simulator: Simulator) -> dict[str, Host]:
    """Add the tree of bodies with their joints and inertias; return them by their joint."""
    hosts: list[Host] = []
    bodies = simulator.bodies()
    for body in bodies:
        is_root = body["parent"] < 0
        parent = Host(world, np.zeros(3)) if is_root else hosts[body["parent"]]
        element = ET.SubElement(
            parent.element, "body", name=body["name"], pos=_numbers(body["offset"])
        )
        if is_root:
            ET.SubElement(element, "joint", name="y0", type="slide", axis=AXES["y"])
            ET.SubElement(element, "joint", name="z0", type="slide", axis=AXES["z"])
        ET.SubElement(
            element,
            "joint",
            name=body["joint"],
            type="hinge",
            axis=AXES[body["axis"]],
            damping=_numbers([body["damping"]]),
        )
        (xx, xy, xz), (_, yy, yz), (_, _, zz) = body["inertia"]
        ET.SubElement(
            element,
            "inertial",
            pos=_numbers(body["com"]),
            mass=_numbers([body["mass"]]),
            fullinertia=_numbers([xx, yy, zz, xy, xz, yz]),
        )
        hosts.append(Host(element, parent.origin + body["offset"]))
    return {body["joint"]: host for body, host in zip(bodies, hosts, strict=True)}


def _add_links(
    hosts: dict[str, Host], segments: Array, sizes: dict[str, Any], contact: bool
) -> None:
    """Draw the 17 links on the bodies that carry them; with `contact`, give the feet soles.

    `segments` are their ends in the world at q = 0 [m], `sizes` a scene's table `body`.
    """
    for number, (name, _) in enumerate(LINKS, start=1):
        carrier = number
        while f"q{carrier}" not in hosts:
            carrier = LINKS[carrier - 1][1]
        host = hosts[f"q{carrier}"]
        start, end = segments[number - 1] - host.origin
        size = sizes[name]
        if name != "foot":
            ET.SubElement(
                host.element,
                "geom",
                type="capsule",
                size=_numbers([size["radius"]]),
                fromto=_numbers([*start, *end]),
            )
            continue
        ET.SubElement(
            host.element,
            "geom",
            type="box",
            size=_numbers([size["width"] / 2, (end[1] - start[1]) / 2, size["height"] / 2]),
            pos=_numbers((start + end + size["height"] * UP) / 2),
        )
        if contact:
            for place, point in (("heel", start), ("toe", end)):
                ET.SubElement(
                    host.element,
                    "geom",
                    name=f"{place}{number}",
                    type="sphere",
                    size=_numbers([CONTACT_RADIUS]),
                    pos=_numbers(point + CONTACT_RADIUS * UP),
                    contype="1",
                )


def _numbers(values: Iterable[float]) -> str:
    """Format numbers so that reading them gives the same bits."""
    return " ".join(repr(float(value)) for value in values)
