"""Errors of derivatives of a motion, each engine against differences of its own motion."""
