"""Random actions on random scenes: every episode ends with a name, and no step takes long."""
