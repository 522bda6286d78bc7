"""Simulate scenes under callgrind: one per line of stdin, each in one call of `step`.

Run as a script that imports next to nothing, as Python is slow under valgrind. Its argument is
the path of the compiled engine; it prints a line per scene: evaluations, simulated time [s].
"""

import sys
from importlib.machinery import ExtensionFileLoader
from importlib.util import module_from_spec, spec_from_file_location


def main(path: str) -> None:
    """Load the engine from its file and simulate what stdin names."""
    loader = ExtensionFileLoader("_core", path)
    spec = spec_from_file_location("_core", path, loader=loader)
    assert spec is not None
    core = module_from_spec(spec)
    loader.exec_module(core)
    for line in sys.stdin:
        sim = core.Simulator(core.Scene.from_json(line))
        sim.step()
        print(sim.stats()["evaluations"], sim.time, flush=True)


if __name__ == "__main__":
    main(sys.argv[1])
