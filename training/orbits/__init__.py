"""Periodic orbits of gaits: closed by Newton's method, with multipliers and margins."""
