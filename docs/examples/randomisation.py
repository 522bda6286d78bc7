"""Random ice and robot parameters in every episode: ranges in a scene, or numbers for a reset.

Run it with ``python docs/examples/randomisation.py``.
"""

import gymnasium

from skate_env import load_scene
from skate_env.scenes import replace

# The same in a scene file, with names in quotes:
#     [randomise]
#     "ice.friction.mu_forward" = [0.1, 0.3]
RANGES = {
    "ice.friction.mu_forward": [0.1, 0.3],
    "body.upper_body.mass": [18.0, 25.0],
    "control.lifting.K_p.2": [5000.0, 6000.0],
}
scene = replace(load_scene("paper"), {"randomise": RANGES})
env = gymnasium.make("skate_env:IceSkate-v0", scene=scene)


def show(what: str) -> None:
    """Print this episode's values of the randomised numbers."""
    numbers = env.unwrapped.simulator.scene.parameters()
    print(f"{what:8}", *(f"{name} = {numbers[name][0]:.6g}" for name in RANGES))


for seed in (0, 1, 2, 0):
    env.reset(seed=seed)
    show(f"seed {seed}")
env.reset()  # Continues the random sequence of the last seed.
show("no seed")
env.reset(seed=0, options={"params": {"ice.friction.mu_forward": 0.25}})
show("params")
env.close()
