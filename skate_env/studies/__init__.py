"""Studies of the engine: accuracy, speed, effects, hard cases, random scenes.

Only the command that runs a study imports it.
"""
