"""How a gait depends on the parameters of its scene."""
