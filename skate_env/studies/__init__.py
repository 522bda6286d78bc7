"""Studies of the engine: accuracy, speed, effects, gaits, hard cases, random scenes.

Only the command that runs a study imports it.
"""
