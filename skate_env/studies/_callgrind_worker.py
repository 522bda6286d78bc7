"""Simulate one action period of each scene on stdin, one per line, under callgrind.

The script has few imports because Python is slow under valgrind. Its arguments are the path of the
compiled engine and the folder of NumPy. It prints the evaluations of each scene in a line.
"""

import json
import sys
from importlib.machinery import ExtensionFileLoader
from importlib.util import module_from_spec, spec_from_file_location


def main(path: str, libraries: str) -> None:
    """Load the engine from its file and simulate the scenes on stdin."""
    sys.path.append(libraries)
    loader = ExtensionFileLoader("_core", path)
    spec = spec_from_file_location("_core", path, loader=loader)
    assert spec is not None
    core = module_from_spec(spec)
    loader.exec_module(core)
    for line in sys.stdin:
        sim = core.Simulator(core.Scene.from_json(json.loads(line)))
        sim.step()
        print(int(sim.stats()["evaluations"]), flush=True)


if __name__ == "__main__":
    main(*sys.argv[1:])
