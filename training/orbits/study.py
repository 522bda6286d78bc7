"""What `python -m training.orbits` measures on the orbit of a scene, as text and JSON."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from skate_env import Scene
from skate_env.policies import OrbitPolicy, Policy

from . import close, forced, measure
from .close import Orbit
from .strobe import units

# Multipliers, and half of the contact states, in the text.
_SHOWN = 12


@dataclass(frozen=True)
class Study:
    """An orbit with its multipliers and measurements.

    Attributes
    ----------
    orbit
        Closed orbit.
    multipliers
        Of a cycle (d,), in the tangent space without translation and memory that is not read;
        largest magnitude first.
    states
        Contact states of a cycle in order, without visits of less than 2 ms.
    slide
        Displacement of the supporting feet while sliding, in a cycle [m].
    margins
        Distances from another order of events.
    decay
        Over ten gait steps.
    returning
        Largest perturbations that return, a random direction each [rad, rad/s]; empty if the cycle
        has more than one step, residual torques, or a multiplier outside the unit circle.
    """

    orbit: Orbit
    multipliers: NDArray[np.complex128]
    states: Sequence[int]
    slide: float
    margins: measure.Margins
    decay: measure.Decay
    returning: Sequence[float]


def study(
    scene: Scene, progress: Callable[[str], object], policy: Policy | OrbitPolicy | None = None
) -> Study:
    """Find and measure the orbit of a scene; ``progress`` receives what is done next.

    With a policy it is an orbit with residual torques, near the policy's motion.

    Raises
    ------
    ValueError
        If the scene's motion ends or has no orbit that is found, or its accuracy locates no events
        or has no derivatives.
    """
    accuracy = scene.get("accuracy")
    if accuracy == "fast" or (isinstance(accuracy, dict) and accuracy["method"] == "moreau"):
        raise ValueError(f"accuracy = {accuracy}: must locate events, such as reference")
    progress("search")
    orbit = close.find(scene) if policy is None else forced.find(scene, policy)
    multipliers = np.linalg.eigvals(orbit.derivative.P).astype(complex)
    multipliers = multipliers[np.argsort(-np.abs(multipliers), kind="stable")]
    progress("decay")
    decay = measure.decay(orbit)
    returning: list[float] = []
    free = orbit.start.torques is None
    if free and orbit.start.steps == 1 and abs(multipliers[0]) < 1.0:
        progress("perturbations")
        returning = [measure.returning(orbit, seed) for seed in range(measure.DIRECTIONS)]
    return Study(
        orbit,
        multipliers,
        measure.states(orbit),
        measure.slide(orbit),
        measure.margins(orbit),
        decay,
        returning,
    )


def summary(found: Study) -> dict[str, Any]:
    """Lay the result out for programs."""
    orbit, start, margins = found.orbit, found.orbit.start, found.margins
    kept = set(orbit.derivative.kept.tolist())
    residual = {
        unit: float(np.abs(orbit.residual[[i for i in where if i in kept]]).max())
        for unit, where in units(orbit.strobe).items()
    }
    largest = 0.0 if start.torques is None else float(np.abs(start.torques).max())
    return {
        "scene": orbit.strobe.scene.name,
        "steps": start.steps,
        "samples": start.samples,
        "sample_period": start.period,
        "tuned": orbit.tuned,
        "period": start.duration,
        "slide": found.slide,
        "largest_residual_torque": largest,
        "states": list(found.states),
        "residual": residual,
        "dimension": len(found.multipliers),
        "multipliers": [[one.real, one.imag] for one in found.multipliers.tolist()],
        "between_events": margins.between,
        "event_to_sample": margins.to_sample,
        "guards": {unit: list(value) for unit, value in margins.guards.items()},
        "nonsmooth": [list(reason) for reason in margins.nonsmooth],
        "decay": {
            "measured": found.decay.measured.tolist(),
            "predicted": found.decay.predicted.tolist(),
            "error": found.decay.errors.tolist(),
        },
        "returning": list(found.returning),
    }


def text(found: Study) -> str:
    """Lay the result out for a terminal."""
    data, strobe, decay = summary(found), found.orbit.strobe, found.decay
    kind = "stable" if abs(found.multipliers[0]) < 1.0 else "unstable"
    states = [str(state) for state in data["states"]]
    if len(states) > 2 * _SHOWN:
        states = [*states[: 2 * _SHOWN], "..."]
    rows = {
        "samples": f"of {1e3 * data['sample_period']:.9g} ms"
        + f" (the scene's {1e3 * strobe.period:g} ms have no short orbit)" * data["tuned"],
        "period": f"{1e3 * data['period']:.6f} ms",
        "slide": f"{data['slide']:.6f} m",
        "residual torques": f"up to {data['largest_residual_torque']:.4g} N m",
        "contact states": "-".join(states),
        "residual": ", ".join(f"{x:.1e} {unit}" for unit, x in data["residual"].items()),
        f"multipliers, {_SHOWN} of {data['dimension']}": "",
        "  modulus": " ".join(f"{x:8.5f}" for x in np.abs(found.multipliers[:_SHOWN])),
        "  angle [rad]": " ".join(f"{x:8.5f}" for x in np.angle(found.multipliers[:_SHOWN])),
        "between events": f"{1e3 * data['between_events']:.3g} ms",
        "event to sample": f"{1e3 * data['event_to_sample']:.3g} ms",
        "guards": ", ".join(
            f"{x:.2g} {unit} ({what})" for unit, (x, what) in data["guards"].items()
        ),
        "nonsmooth": f"{len(data['nonsmooth'])} reasons against the derivative",
        f"decay, {len(decay.errors) - 1} gait steps": f"{decay.measured[0]:.1e} to "
        f"{decay.measured[-1]:.3e}, predicted {decay.predicted[-1]:.3e}; largest deviation of the "
        f"vectors {decay.errors.max():.1e} of the prediction",
        "returning noise": ", ".join(f"{x:.3g}" for x in found.returning) or "not measured",
    }
    head = (
        f"{data['scene']}: {kind} orbit of {data['steps']} gait step(s), {data['samples']} samples"
    )
    return "\n".join([head, *(f"{name:<24}{value}".rstrip() for name, value in rows.items())])
