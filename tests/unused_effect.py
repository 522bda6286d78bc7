"""Show that an effect which no scene uses has no cost.

Run it with ``make unused``. It adds a term of the controller and a guard to a copy of the engine,
builds that, and counts the instructions of every preset with both engines. It needs valgrind and
takes some minutes; it fails if a count rises by more than a thousandth.
"""

import shutil
import subprocess
import sys
import tempfile
import zipfile
from pathlib import Path

from skate_env import load_scene, scene_names
from skate_env.studies import callgrind

ROOT = Path(__file__).parents[1]
CORE = "rust/skate-core/src"
# Additions: file, a text that occurs in it once, and its replacement.
ADDITIONS = (
    (
        f"{CORE}/model/controller_terms.rs",
        "    KneeStop(KneeStop),\n",
        "    KneeStop(KneeStop),\n    Wind(f64),\n",
    ),
    (
        f"{CORE}/model/controller_terms.rs",
        "    let all = [\n",
        '    let all = [\n        (scene.name == "windy").then_some(Term::Wind(3.0)),\n',
    ),
    (
        f"{CORE}/model/controller_terms.rs",
        "            Self::Lifting(_) | Self::HeadDamping(_) => false,\n",
        "            Self::Lifting(_) | Self::HeadDamping(_) | Self::Wind(_) => false,\n",
    ),
    (
        f"{CORE}/control/mod.rs",
        "            Term::ArmSwing { .. } | Term::HipPd",
        "            Term::Wind(_) | Term::ArmSwing { .. } | Term::HipPd",
    ),
    (
        f"{CORE}/control/mod.rs",
        "            Term::Feedforward(_) | Term::ArmSwing { .. } => {}\n",
        "            Term::Feedforward(_) | Term::ArmSwing { .. } => {}\n"
        "            Term::Wind(force) => wind(*force, v, tau),\n",
    ),
    (
        f"{CORE}/control/mod.rs",
        "                // They depend on positions and velocities.\n",
        "                Term::Wind(_) => {}\n",
    ),
    (
        f"{CORE}/control/mod.rs",
        "/// What the open-loop torques",
        "#[inline(always)]\n"
        "fn wind<T: Scalar>(force: f64, v: &[T; NV], tau: &mut [T; NV]) {\n"
        "    for c in ROOT..ROOT + 6 {\n"
        "        let wave = T::from_lanes(|i| (0.1 * v[c].lane(i)).sin());\n"
        "        tau[c] -= T::of(force) * v[c] * v[c].abs() * wave;\n"
        "    }\n"
        "}\n\n"
        "/// What the open-loop torques",
    ),
    (
        f"{CORE}/control/joint_torques.rs",
        "        Term::Lifting(_) | Term::HeadDamping(_) => {}\n",
        "        Term::Lifting(_) | Term::HeadDamping(_) | Term::Wind(_) => {}\n",
    ),
    (
        f"{CORE}/control/head_force.rs",
        "            Term::Feedforward(_) | Term::ArmSwing { .. } => vec3::zero(),\n",
        "            Term::Wind(_) => vec3::zero(),\n"
        "            Term::Feedforward(_) | Term::ArmSwing { .. } => vec3::zero(),\n",
    ),
    (
        f"{CORE}/control/head_force.rs",
        "            Term::Feedforward(_) | Term::ArmSwing { .. } => {}\n",
        "            Term::Feedforward(_) | Term::ArmSwing { .. } | Term::Wind(_) => {}\n",
    ),
    (
        f"{CORE}/events/guards.rs",
        "        guards.push_friction(model, SUPPORT, mode.support);\n",
        "        guards.push_friction(model, SUPPORT, mode.support);\n"
        '        if model.scene.name == "windy" {\n'
        "            guards.push(Guard::Fall);\n"
        "        }\n",
    ),
)


def build(folder: Path) -> Path:
    """Build the engine with the additions; return the path of the compiled module."""
    tree = folder / "tree"
    files = subprocess.run(
        ["git", "ls-files"], cwd=ROOT, check=True, capture_output=True, text=True
    ).stdout.split()
    for name in files:
        target = tree / name
        target.parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(ROOT / name, target)
    for name, line, replacement in ADDITIONS:
        path = tree / name
        text = path.read_text(encoding="utf-8")
        if text.count(line) != 1:
            sys.exit(f"{name} has changed: it no longer holds {line.strip()!r} once")
        path.write_text(text.replace(line, replacement), encoding="utf-8")
    subprocess.run(
        ["maturin", "build", "--quiet", "--release", "--out", str(folder)], cwd=tree, check=True
    )
    (wheel,) = folder.glob("*.whl")
    with zipfile.ZipFile(wheel) as archive:
        (module,) = (name for name in archive.namelist() if name.endswith((".so", ".pyd")))
        return Path(archive.extract(module, folder))


def main() -> None:
    names = scene_names()
    period = {"control.action_period": 0.25}
    scenes = [load_scene(name).with_values(period) for name in names]
    with tempfile.TemporaryDirectory() as folder:
        engine = build(Path(folder))
        before = callgrind.instructions_per_evaluation(scenes)
        after = callgrind.instructions_per_evaluation(scenes, engine=engine)
    print("instructions per evaluation: the engine, and with an effect that no scene uses")
    for name, old, new in zip(names, before, after, strict=True):
        print(f"{name:<14}{old:>12.1f}{new:>12.1f}{new / old - 1.0:>+11.4%}")
    if max(new / old for old, new in zip(before, after, strict=True)) > 1.001:
        sys.exit("an unused effect has a cost")


if __name__ == "__main__":
    main()
