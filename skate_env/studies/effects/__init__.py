"""Cost of each effect of a scene, and the change of the motion."""
