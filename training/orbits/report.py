"""An orbit for people and programs: text, Markdown, JSON."""

import json
import textwrap
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from skate_env.common import files

from . import chart
from .parts import SMALLEST
from .strobe import units
from .study import Study

_WIDTH = 100
# Multipliers in the text.
_SHOWN = 12


def summary(found: Study) -> dict[str, Any]:
    """Lay the result out for programs."""
    orbit, start = found.orbit, found.orbit.start
    kept = set(orbit.derivative.kept.tolist())
    residual = {
        unit: float(np.abs(orbit.residual[[i for i in where if i in kept]]).max())
        for unit, where in units(orbit.strobe).items()
    }
    margins = found.margins
    determinants = found.determinants
    product = None if np.isnan(determinants.product) else determinants.product
    return {
        "scene": orbit.strobe.scene.name,
        "steps": start.steps,
        "samples": start.samples,
        "sample_period": start.period,
        "tuned": orbit.tuned,
        "period": start.duration,
        "slide": found.slide,
        "largest_residual_torque": _largest(start.torques),
        "states": list(found.states),
        "residual": residual,
        "dimension": len(found.multipliers),
        "zero_by_construction": determinants.structural,
        "multipliers": [[one.real, one.imag] for one in found.multipliers.tolist()],
        "product": product,
        "product_of_parts": None if product is None else determinants.composed,
        "liouville": determinants.liouville,
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


def _largest(torques: NDArray[np.float64] | None) -> float:
    return 0.0 if torques is None else float(np.abs(torques).max())


def text(found: Study) -> str:
    """Lay the result out for a terminal."""
    data = summary(found)
    kind = "stable" if abs(found.multipliers[0]) < 1.0 else "unstable"
    largest = data["largest_residual_torque"]
    samples = f"{data['samples']} samples of {1e3 * data['sample_period']:.9g} ms"
    if data["tuned"]:
        own = 1e3 * found.orbit.strobe.period
        samples += f" (the scene's {own:g} ms have no short orbit)"
    lines = [
        f"{data['scene']}: {kind} orbit of {data['steps']} gait step(s), {samples}: period "
        f"{1e3 * data['period']:.6f} ms, slide {data['slide']:.6f} m"
        + (f", residual torques up to {largest:.4g} N m." if largest else "."),
        "Contact states: " + "-".join(map(str, _shortened(data["states"]))) + ".",
        "Residual: "
        + ", ".join(f"{value:.1e} {unit}" for unit, value in data["residual"].items())
        + ".",
        f"Multipliers: {data['dimension']}, of which {data['zero_by_construction']} are zero by "
        "construction. Largest: "
        + ", ".join(_complex(one) for one in found.multipliers[:_SHOWN].tolist())
        + ".",
        f"Liouville's formula, over the first 20 us of the parts: largest deviation of log det "
        f"{data['liouville']:.0e}."
        + (
            ""
            if data["product"] is None
            else f" Product of the multipliers above {SMALLEST:g}: {data['product']:.7g}; through "
            f"the parts {data['product_of_parts']:.7g}."
        ),
        f"Margins: {1e3 * data['between_events']:.3g} ms between events, "
        f"{1e3 * data['event_to_sample']:.3g} ms between an event and a sample; guards "
        + ", ".join(f"{x:.2g} {unit} ({what})" for unit, (x, what) in data["guards"].items())
        + f". Reasons against the derivative: {len(data['nonsmooth'])}.",
        f"Decay over {len(found.decay.errors) - 1} gait steps: {found.decay.measured[0]:.1e} to "
        f"{found.decay.measured[-1]:.3e}, predicted {found.decay.predicted[-1]:.3e}; largest "
        f"deviation of the vectors {found.decay.errors.max():.1e} of the prediction.",
    ]
    if found.returning:
        sizes = ", ".join(f"{size:.3g}" for size in found.returning)
        lines.append(
            f"Largest noise on all angles and rates that returns, by direction: {sizes} rad, rad/s."
        )
    return "\n".join(textwrap.fill(line, _WIDTH, subsequent_indent="  ") for line in lines)


def _shortened(states: list[int]) -> list[Any]:
    return states if len(states) <= 2 * _SHOWN else [*states[: 2 * _SHOWN], "..."]


def _complex(one: complex) -> str:
    if one.imag == 0.0:
        return f"{one.real:.5g}"
    return f"{one.real:.5g}{one.imag:+.5g}i"


def write(found: Study, folder: Path, command: str) -> None:
    """Write orbit.md, orbit.json and orbit.png into a folder."""
    blocks = ["# Orbit of a gait", f"Written by `{command}`.", text(found), "![Orbit](orbit.png)"]
    data = json.dumps(summary(found), allow_nan=False, indent=1)
    files.write_all(
        {
            folder / "orbit.png": files.png(chart.draw(found), dpi=130),
            folder / "orbit.md": ("\n\n".join(blocks) + "\n").encode(),
            folder / "orbit.json": (data + "\n").encode(),
        }
    )
