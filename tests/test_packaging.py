"""Dependencies of the package, and what works without optional ones."""

import re
import subprocess
import sys
import textwrap
import zlib
from importlib.metadata import distribution
from pathlib import Path

import pytest
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

import skate_env

ROOT = Path(__file__).parents[1]
HEAVY = ("torch", "pygame", "ray", "stable_baselines3", "moviepy", "imageio_ffmpeg")


def run_without(modules, code):
    """Run Python in a separate process in which these modules cannot be imported."""
    barrier = f"""
        import sys
        class Barrier:
            def find_spec(self, name, path=None, target=None):
                if name.partition(".")[0] in {modules!r}:
                    raise ModuleNotFoundError(f"No module named {{name!r}}", name=name)
        sys.meta_path.insert(0, Barrier())
    """
    whole = textwrap.dedent(barrier) + textwrap.dedent(code)
    command = [sys.executable, "-W", "error", "-c", whole]
    return subprocess.run(command, capture_output=True, text=True, timeout=120)


def test_environments_replay_and_pictures_need_none_of_the_heavy_libraries(tmp_path):
    run = run_without(
        HEAVY,
        f"""
        import gymnasium, numpy, skate_env
        from skate_env.cli import app
        env = gymnasium.make("IceSkate-v0", render_mode="rgb_array")
        env.reset(seed=0)
        env.step(numpy.zeros(10, numpy.float32))
        assert env.render().max() > 0
        batch = gymnasium.make_vec("IceSkate-v0", num_envs=2)
        batch.reset(seed=0)
        batch.step(numpy.zeros((2, 10), numpy.float32))
        assert not set({HEAVY!r}) & set(sys.modules)
        app(["replay", "--steps", "1", "--out", {str(tmp_path)!r}])
        """,
    )
    assert run.returncode == 0, run.stdout + run.stderr
    assert list(tmp_path.iterdir())


def test_without_stable_baselines3_its_adapter_says_what_to_install():
    run = run_without(HEAVY, "import skate_env.sb3")
    assert run.returncode == 1
    assert 'pip install "skate-env[train]"' in run.stderr.splitlines()[-1]


@pytest.fixture(scope="module")
def core():
    """All distributions that ``pip install skate-env`` installs."""
    found, new = {}, ["skate-env"]
    while new:
        name = new.pop()
        if name in found:
            continue
        found[name] = distribution(name)
        for text in found[name].requires or []:
            requirement = Requirement(text)
            if requirement.marker is None or requirement.marker.evaluate({"extra": ""}):
                new.append(canonicalize_name(requirement.name))
    return found


def test_the_core_needs_no_heavy_library(core):
    assert {"gymnasium", "numpy", "matplotlib"} < set(core)
    heavy = {canonicalize_name(name) for name in (*HEAVY, "pygame-ce", "jax", "scipy", "pyarrow")}
    assert not heavy & set(core)
    assert not [name for name in core if name.startswith("nvidia")]


def test_the_core_downloads_less_than_100_mb(core):
    # Deflated at the fastest level, which overestimates wheels: they take 47 MB on Linux, 55 here.
    files = [file.locate() for each in core.values() for file in each.files or []]
    files.append(skate_env._core.__file__)
    size = 0
    for file in map(str, files):
        if not file.endswith(".pyc"):
            with open(file, "rb") as content:
                size += len(zlib.compress(content.read(), 1))
    assert 20e6 < size < 100e6


def test_the_version_is_the_same_everywhere():
    version = skate_env.__version__
    for name in ("pyproject.toml", "Cargo.toml", "rust/skate-web/Cargo.toml"):
        written = re.findall(r'^version = "(.+)"$', (ROOT / name).read_text(encoding="utf-8"), re.M)
        assert written == [version], name
    for name in ("Cargo.lock", "rust/skate-web/Cargo.lock"):
        text = (ROOT / name).read_text(encoding="utf-8")
        assert set(re.findall(r'^name = "skate-.+"\nversion = "(.+)"$', text, re.M)) == {version}
    assert f"\nversion: {version}\n" in (ROOT / "CITATION.cff").read_text(encoding="utf-8")
    changes = (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")
    assert re.findall(r"^## (.+)$", changes, re.M)[0] == version


def test_workflows_use_fixed_actions_and_locked_dependencies():
    for path in (ROOT / ".github" / "workflows").glob("*.yml"):
        text = path.read_text(encoding="utf-8")
        for used in re.findall(r"uses: (.+)", text):
            assert re.fullmatch(r"\./[\w./-]+|[\w/-]+@[0-9a-f]{40} # v[\d.]+", used), used
        for command in re.findall(r"cargo .+|args: --release.+", text):
            assert "--locked" in command, (path, command)
