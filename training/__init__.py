"""Searching and learning on top of `skate_env`."""
