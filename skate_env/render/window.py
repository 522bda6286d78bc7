"""A window that shows pictures with pygame-ce."""

from typing import Any

import numpy as np
from gymnasium.error import DependencyNotInstalled
from numpy.typing import NDArray


class Window:
    """Shows pictures at a constant rate; opens with the first one.

    Parameters
    ----------
    period
        Time from one picture to the next [s]; `show` waits for it.

    Raises
    ------
    gymnasium.error.DependencyNotInstalled
        If pygame is missing.
    """

    def __init__(self, period: float) -> None:
        try:
            import pygame
        except ImportError:
            raise DependencyNotInstalled(
                'a window needs pygame: pip install "skate-env[render]"'
            ) from None
        self._pygame: Any = pygame
        self._period = period
        self._screen: Any = None
        self._clock: Any = None
        self._closed = False

    @property
    def closed(self) -> bool:
        """Whether it was closed, by the user or by `close`."""
        return self._closed

    def show(self, frame: NDArray[np.uint8]) -> None:
        """Show a picture (height, width, 3); a closed window ignores it."""
        if self._closed:
            return
        pygame = self._pygame
        size = frame.shape[1], frame.shape[0]
        if self._screen is None:
            pygame.display.init()
            self._screen = pygame.display.set_mode(size)
            pygame.display.set_caption("IceSkate-v0")
            self._clock = pygame.time.Clock()
        self._screen.blit(pygame.image.frombuffer(frame.tobytes(), size, "RGB"), (0, 0))
        pygame.display.flip()
        self._clock.tick(1.0 / self._period)
        if pygame.event.get(pygame.QUIT):
            self.close()
        else:
            # The event queue has to be read, or the window stops responding.
            pygame.event.clear()

    def close(self) -> None:
        """Close the window permanently; closing twice is allowed."""
        self._closed = True
        if self._screen is not None:
            self._screen = None
            self._pygame.display.quit()
