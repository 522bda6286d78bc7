"""Learners on the three ids: Stable-Baselines3, its zoo, RLlib, and SHAC."""
