"""Show that two commits compute the same motions, bit for bit.

Run it as ``python tests/compare_commits.py OLD``. It builds the commit OLD in a folder of its own,
runs ``motion_hashes.py`` with that package and with the present one, which must be built (``make
replay`` does so), and compares the hashes: every preset at five accuracies, with and without
residual torques, and vector environments. It takes one build and half a minute, and fails where a
hash differs.
"""

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parents[1]
OLD = ROOT / "target" / "old"
HASHES = Path(__file__).with_name("motion_hashes.py")


def hashes(folder: Path) -> dict[str, str]:
    """Hash the motions of the package in a folder."""
    environment = {**os.environ, "PYTHONPATH": str(folder)}
    done = subprocess.run(
        [sys.executable, str(HASHES)], env=environment, check=True, capture_output=True, text=True
    )
    found: dict[str, str] = json.loads(done.stdout)
    return found


def main(commit: str) -> None:
    """Build the commit, compare all motions, and say which differ."""
    subprocess.run(["git", "worktree", "prune"], cwd=ROOT, check=True)
    shutil.rmtree(OLD, ignore_errors=True)
    subprocess.run(["git", "worktree", "add", "--detach", str(OLD), commit], cwd=ROOT, check=True)
    try:
        subprocess.run(["cargo", "build", "--release", "-p", "skate-py"], cwd=OLD, check=True)
        release = OLD / "target" / "release"
        built = next(p for p in release.iterdir() if p.name in ("lib_core.so", "lib_core.dylib"))
        shutil.copyfile(built, OLD / "skate_env" / "_core.abi3.so")
        old, new = hashes(OLD), hashes(ROOT)
    finally:
        subprocess.run(["git", "worktree", "remove", "--force", str(OLD)], cwd=ROOT, check=True)
    different = [name for name in old if old[name] != new.get(name)]
    print(f"{len(old) - len(different)} of {len(old)} motions have the same bits")
    for name in different:
        print(f"  differs: {name}")
    sys.exit(bool(different) or len(new) != len(old))


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    main(sys.argv[1])
