"""``python -m skate_env`` is the command ``skate-env``."""

from .cli import main

main()
