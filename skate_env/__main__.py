"""``python -m skate_env`` is the command ``skate-env``."""

from .cli import app

app(prog_name="skate-env")
