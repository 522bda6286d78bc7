"""Simulate under callgrind what stdin names, a run per line.

Run as a script that imports next to nothing, as Python is slow under valgrind. Its arguments are
the path of the compiled engine and the folder where NumPy is, which only a run with torques needs;
it prints a line per run: evaluations, simulated time [s].
"""

import json
import sys
from importlib.machinery import ExtensionFileLoader
from importlib.util import module_from_spec, spec_from_file_location


def main(path: str, libraries: str) -> None:
    """Load the engine from its file and simulate what stdin names."""
    sys.path.append(libraries)
    loader = ExtensionFileLoader("_core", path)
    spec = spec_from_file_location("_core", path, loader=loader)
    assert spec is not None
    core = module_from_spec(spec)
    loader.exec_module(core)
    for line in sys.stdin:
        run = json.loads(line)
        sim = core.Simulator(core.Scene.from_json(run["scene"]))
        torque = run["torque"]
        if torque is not None:
            from numpy import array

            torque = array(torque)
        if run["until"] is None:
            sim.step(torque)
        else:
            sim.advance(run["until"], torque)
        print(sim.stats()["evaluations"], sim.time, flush=True)


if __name__ == "__main__":
    main(*sys.argv[1:])
