"""Contact forces of every gait step, in arrays.

Run it with ``python docs/examples/forces.py``.
"""

import numpy as np

import skate_env

sim = skate_env.Simulator("paper")
times, samples, swaps = [], [], []
while len(swaps) < 5 and sim.step():
    times.append(sim.time)
    samples.append(sim.contact_forces)
    # A gait step ends when the legs swap their roles.
    swaps += [step["time"] for step in sim.take_steps()]

# Rows: supporting and free foot. Columns: f_y, N, N at the heel, N at the toe [N].
forces = np.array(samples)
steps = np.split(forces, np.searchsorted(times, swaps))[: len(swaps)]
for i, step in enumerate(steps, 1):
    total = step[:, :, 1].sum(axis=1)
    print(f"step {i}: {step.shape}, mean N {total.mean():.0f} N, largest {total.max():.0f} N")
