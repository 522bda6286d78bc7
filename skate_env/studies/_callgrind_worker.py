"""Simulate the runs on stdin, one per line, under callgrind.

The script has few imports because Python is slow under valgrind. Its arguments are the path of the
compiled engine and the folder of NumPy, which is imported for runs with torques only. It prints
evaluations and simulated time [s] of each run in a line.
"""

import json
import sys
from importlib.machinery import ExtensionFileLoader
from importlib.util import module_from_spec, spec_from_file_location


def main(path: str, libraries: str) -> None:
    """Load the engine from its file and simulate the runs on stdin."""
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
