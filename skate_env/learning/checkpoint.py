"""Checkpoints: a resumed training gives the same policy bit for bit."""

import io
import pickle
import random
from pathlib import Path
from typing import Any

import numpy as np
import torch
from stable_baselines3 import PPO
from stable_baselines3.common.running_mean_std import RunningMeanStd
from stable_baselines3.common.vec_env import VecNormalize

from ..common import read_bytes, write_bytes
from ..sb3 import IceSkateVecEnv

# Limit on a checkpoint's file [bytes].
_MOST = 2**31


def save(model: PPO, path: Path, about: Any) -> None:
    """Write learner, normaliser, environments and random states; call it before a rollout.

    Parameters
    ----------
    model
        Learner with an `IceSkateVecEnv` in a `VecNormalize`; raises TypeError for others.
    path
        The file, which is replaced atomically.
    about
        Further data, which `load` returns.
    """
    normaliser, _, env = environments(model)
    learner = io.BytesIO()
    model.save(learner)
    saved = {
        "about": about,
        "learner": learner.getvalue(),
        "normaliser": normaliser,
        # The normaliser does not pickle its environments.
        "environments": env,
        "returns": normaliser.returns,
        "random": (random.getstate(), np.random.get_state(), torch.get_rng_state()),
    }
    write_bytes(path, pickle.dumps(saved))


def load(path: Path) -> tuple[PPO, Any]:
    """Read a file of `save`; only trusted files, because a pickle can run any code."""
    try:
        data = read_bytes(path, _MOST)
    except ValueError as error:
        raise ValueError(f"checkpoint {path}: {error}") from None
    try:
        return _loaded(data)
    # A damaged pickle raises many types of exceptions.
    except Exception as error:
        kind = type(error).__name__
        raise ValueError(f"checkpoint {path}: not readable: {kind}: {error}") from None


def _loaded(data: bytes) -> tuple[PPO, Any]:
    saved = pickle.loads(data)
    normaliser: VecNormalize = saved["normaliser"]
    normaliser.set_venv(saved["environments"])
    normaliser.returns = saved["returns"]
    model = PPO.load(io.BytesIO(saved["learner"]), env=normaliser, device="cpu", force_reset=False)
    # Loading a learner draws random numbers.
    of_python, of_numpy, of_torch = saved["random"]
    random.setstate(of_python)
    np.random.set_state(of_numpy)
    torch.set_rng_state(of_torch)
    return model, saved["about"]


def environments(model: PPO) -> tuple[VecNormalize, RunningMeanStd, IceSkateVecEnv]:
    """Return a learner's normaliser, the observation statistics and the environments.

    Raises
    ------
    TypeError
        If the learner's environments are not an `IceSkateVecEnv` in a `VecNormalize`.
    """
    normaliser = model.get_env()
    if not isinstance(normaliser, VecNormalize) or not isinstance(normaliser.venv, IceSkateVecEnv):
        raise TypeError(f"{type(normaliser).__name__}: must be an IceSkateVecEnv in a VecNormalize")
    if not isinstance(normaliser.obs_rms, RunningMeanStd):
        raise TypeError(f"observations are {type(normaliser.obs_rms).__name__}: must be vectors")
    return normaliser, normaliser.obs_rms, normaliser.venv
