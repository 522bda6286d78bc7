"""Rendering of an environment, according to its ``render_mode``."""

from collections.abc import Callable
from typing import Any

import gymnasium
import numpy as np
from gymnasium.error import ResetNeeded
from numpy.typing import NDArray

from .._core import Simulator
from ..common import shown
from .renderer import Renderer
from .window import Window

MODES = ("human", "rgb_array")
# Minimum time between two pictures of a window, so that it can follow the motion [s].
_LEAST_PERIOD = 0.02


class EnvPictures:
    """Pictures of one environment according to Gymnasium's interface.

    Parameters
    ----------
    mode
        None, "rgb_array" or "human".
    action_period
        Duration of an action [s].
    simulator
        Returns the environment's simulator or a copy of it.

    Raises
    ------
    ValueError
        For any other mode.
    gymnasium.error.DependencyNotInstalled
        For "human", if pygame is missing.
    """

    def __init__(
        self, mode: str | None, action_period: float, simulator: Callable[[], Simulator]
    ) -> None:
        if mode is not None and mode not in MODES:
            raise ValueError(f"render_mode is {shown(mode)}: it must be None, {', '.join(MODES)}")
        self._mode = mode
        self._simulator = simulator
        self._renderer: Renderer | None = None
        self._stride = max(round(_LEAST_PERIOD / action_period), 1)
        self._window = Window(self._stride * action_period) if mode == "human" else None
        # Actions since the reset, None before the first one.
        self._actions: int | None = None

    @staticmethod
    def metadata(action_period: float) -> dict[str, Any]:
        """Return the `metadata` of an environment with an action period [s]."""
        return {"render_modes": list(MODES), "render_fps": round(1.0 / action_period)}

    def after_reset(self) -> None:
        """Register a new episode and show it in the window."""
        self._actions = 0
        self._show()

    def after_step(self) -> None:
        """Register an action and show the state in the window."""
        if self._actions is not None:
            self._actions += 1
            if self._actions % self._stride == 0:
                self._show()

    def render(self) -> NDArray[np.uint8] | None:
        """Draw the present state; None if the mode returns no pictures.

        Raises
        ------
        gymnasium.error.ResetNeeded
            Before the first reset.
        """
        if self._mode is None:
            gymnasium.logger.warn(
                'render() draws nothing: make the environment with render_mode="rgb_array"'
            )
            return None
        if self._actions is None:
            raise ResetNeeded("render() before reset(): there is nothing to draw yet")
        if self._mode == "human":
            return None
        return self._draw()

    def close(self) -> None:
        """Close the window, if there is one."""
        if self._window is not None:
            self._window.close()

    def _show(self) -> None:
        if self._window is not None and not self._window.closed:
            self._window.show(self._draw())

    def _draw(self) -> NDArray[np.uint8]:
        if self._renderer is None:
            self._renderer = Renderer()
        return self._renderer.draw(self._simulator())
