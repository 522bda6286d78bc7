"""Benchmark of IceSkate and other simulators: evaluations, steps, environments, learning."""
