"""A linear feedback about the periodic orbit of a gait, in one file.

It is used like a learned policy; `python -m training.orbits --feedback` makes one::

    policy = skate_env.policies.load("paper.npz")
    env = gymnasium.make("IceSkate-v0", **policy.environment())
    observation, info = env.reset(seed=0)
    action, _ = policy.predict(observation)
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .._core import Scene
from . import archive, checks
from .residual import Residual, Single

Array = NDArray[np.float64]

# Observations whose phases are chosen at once.
_ROWS = 32
# Least limit of the cost-to-go, and the range of a policy's numbers: no sum overflows float32.
_LEAST_LIMIT, _LARGEST = 1e-9, 1e9
_RANGE = (-_LARGEST, _LARGEST)


@dataclass(frozen=True, eq=False)
class OrbitPolicy(Residual):
    """Torques ``a* - K (z - z*)`` about an orbit, with gains by phase.

    z are the angles, the velocity of the supporting foot and the rates. The m phases are points of
    the orbit. The phase of an observation is the point with the least cost-to-go
    ``|L (z - z*)|^2``: the phase is not a clock, so a late step is controlled as a late step. Where
    the cost-to-go exceeds a limit, ``z - z*`` is shortened until it does not. In left support
    observations and actions are mirrored.

    Attributes
    ----------
    scene
        Scene of the orbit.
    references
        ``z*`` (m, d).
    actions
        ``a*`` (m, joints): those of the orbit, zero without residual torques.
    gains
        K (m, joints, d), in parts of a full action per unit of z.
    roots
        L (m, d, d), square roots of the cost-to-go.
    limit
        Cost-to-go above which deviations are shortened; 1e-9 to 1e9.
    action_scale
        Residual torque of a full action by joint [N m].
    observation_names, joint_names
        Names of observations and joints, as in `IceSkateEnv`.
    about
        Data of the design as JSON values.

    Raises
    ------
    TypeError, ValueError
        If arrays, names and scene do not match or a number is out of range; the message names it.
    """

    scene: Scene
    references: Array
    actions: Single
    gains: Single
    roots: Single
    limit: float
    action_scale: Mapping[str, float]
    observation_names: Sequence[str]
    joint_names: Sequence[str]
    about: Mapping[str, Any]

    def __post_init__(self) -> None:
        names = self.observation_names, self.joint_names
        parts = checks.parts(self.scene, self.action_scale, *names, self.about)
        d, n = len(archive.inputs(self.observation_names)), len(self.joint_names)
        references = checks.numbers("references", self.references, ("phases", d), *_RANGE)
        m = len(references)
        if not m:
            raise ValueError("references: must have at least one row")
        fields = parts | {
            "references": references,
            "actions": checks.single("actions", self.actions, (m, n), *_RANGE),
            "gains": checks.single("gains", self.gains, (m, n, d), *_RANGE),
            "roots": checks.single("roots", self.roots, (m, d, d), *_RANGE),
            "limit": checks.scalar("limit", self.limit, _LEAST_LIMIT, _LARGEST),
        }
        for name, value in fields.items():
            object.__setattr__(self, name, value)

    def _actions(self, seen: Array, deterministic: bool) -> Single:
        """Return the actions; there is no noise."""
        # Larger numbers overflow single precision.
        z = seen[..., self._inputs].reshape(-1, len(self._inputs)).clip(-_LARGEST, _LARGEST)
        at, least = np.empty(len(z), np.int64), np.empty(len(z))
        for rows in np.array_split(np.arange(len(z)), max(1, len(z) // _ROWS)):
            apart = (z[rows] - self.references[:, None]).astype(np.float32)
            costs = np.square(apart @ self.roots.swapaxes(1, 2)).sum(axis=2)
            at[rows], least[rows] = costs.argmin(axis=0), costs.min(axis=0)
        off = z - self.references[at]
        off *= np.sqrt(self.limit / np.maximum(least, self.limit))[:, None]
        changes = np.einsum("ijk,ik->ij", self.gains[at], off.astype(np.float32))
        actions: Single = (self.actions[at] - changes).clip(-1.0, 1.0)
        return actions.reshape(*seen.shape[:-1], len(self.joint_names))

    def save(self, path: str | Path) -> None:
        """Write everything to one compressed ``.npz`` file, which is replaced atomically.

        Raises
        ------
        OSError
            If the file cannot be written; one that exists is unchanged.
        """
        names = ("references", "actions", "gains", "roots", "limit")
        arrays = {name: getattr(self, name) for name in names}
        self._write(path, archive.ORBIT, arrays)

    @cached_property
    def _inputs(self) -> list[int]:
        return archive.inputs(self.observation_names)
