"""Pictures of the robot on the ice, without a display or a graphics card.

`Renderer` draws one picture of a simulator, `SideBySide` one of two; `Window` shows pictures and
needs the extra `render`.
"""

from .for_env import EnvPictures
from .renderer import Renderer
from .side_by_side import SideBySide
from .window import Window

__all__ = ["EnvPictures", "Renderer", "SideBySide", "Window"]
