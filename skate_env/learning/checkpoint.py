"""Checkpoints: a resumed training gives the same policy bit for bit."""

import io
import os
import pickle
import random
from pathlib import Path
from typing import Any

import numpy as np
import torch
from stable_baselines3 import PPO
from stable_baselines3.common.vec_env import VecNormalize

from .training_env import environments


def save(model: PPO, path: Path, about: dict[str, Any]) -> None:
    """Write learner, normaliser, environments and random states; call it before a rollout.

    Parameters
    ----------
    model
        Learner with a `TrainingEnv` in a `VecNormalize`; raises TypeError for others.
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
    part = path.with_suffix(".part")
    part.write_bytes(pickle.dumps(saved))
    os.replace(part, path)


def load(path: Path) -> tuple[PPO, dict[str, Any]]:
    """Read a file of `save`; only trusted files, because a pickle can run any code."""
    saved = pickle.loads(path.read_bytes())
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
