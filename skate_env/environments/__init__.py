"""The Gymnasium environments: single and vector, their keywords, and the task of any ice."""

from .config import PAPER_ACTIONS, TORQUE_SCALE, Observation, chosen_joints, joints
from .single import IceSkateEnv
from .tasks import any_ice, any_ice_scene, any_ice_vector
from .vector import IceSkateVectorEnv

__all__ = [
    "PAPER_ACTIONS",
    "TORQUE_SCALE",
    "IceSkateEnv",
    "IceSkateVectorEnv",
    "Observation",
    "any_ice",
    "any_ice_scene",
    "any_ice_vector",
    "chosen_joints",
    "joints",
]
