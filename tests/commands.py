"""Commands by name, for tests: those of ``skate-env``, and those of a checkout."""

import importlib
import sys
from typing import Any

from typer.testing import CliRunner

from skate_env.cli import app

MODULES = {
    "bench": "tests.bench.__main__",
    "gaits": "training.gaits.__main__",
    "laws": "tests.campaigns.laws",
    "orbit": "training.orbits.__main__",
    "sensitivity": "training.sensitivity",
    "stress": "tests.campaigns.stress",
}


def invoke(name: object, *arguments: object) -> Any:
    """Run a command in this process."""
    texts = [str(argument) for argument in arguments]
    if name in MODULES:
        return CliRunner().invoke(importlib.import_module(MODULES[str(name)]).app, texts)
    return CliRunner().invoke(app, [str(name), *texts])


def line(name: str, *arguments: object) -> list[str]:
    """Return the command line that runs a command in a process of its own."""
    texts = [str(argument) for argument in arguments]
    if name in MODULES:
        return [sys.executable, "-m", MODULES[name].removesuffix(".__main__"), *texts]
    return [sys.executable, "-m", "skate_env", name, *texts]
