"""``IceSkate-v0`` is registered in every process, without ``import skate_env``."""

import multiprocessing
import os
import re
import shutil
import subprocess
import sys
from importlib.metadata import entry_points
from pathlib import Path

import gymnasium
import pytest

from skate_env.registration import IDS

ID, *_ = IDS
ROOT = Path(__file__).parents[1]
STARTUP = "skate_env_startup.pth"
MAKE = """
import sys, gymnasium
env = gymnasium.make("IceSkate-v0")
env.reset(seed=0)
env.step(env.action_space.sample())
envs = gymnasium.make_vec("IceSkate-v0", num_envs=2)
assert type(envs).__name__ == "IceSkateVectorEnv"
envs.reset(seed=0)
"""


def python(code, *options, **environment):
    """Run Python in a separate process without output; warnings are errors."""
    done = subprocess.run(
        [sys.executable, *options, "-W", "error", "-c", code],
        capture_output=True,
        text=True,
        timeout=120,
        env=os.environ | environment,
    )
    assert done.returncode == 0, done.stderr
    assert done.stderr == "", done.stderr


@pytest.mark.parametrize("first", ["", "import skate_env", "import gymnasium, skate_env"])
def test_bare_make_and_make_vec(first):
    python(first + MAKE)


def test_an_interpreter_without_start_up_hooks_needs_the_import():
    paths = f"import sys; sys.path[:] = {sys.path!r}\n"
    python(paths + "import skate_env" + MAKE, "-S")


def test_start_imports_neither_gymnasium_nor_the_package():
    python("import sys; assert not {'gymnasium', 'skate_env', 'numpy'} & set(sys.modules)")


def test_the_entry_point_registers():
    (point,) = entry_points(group="gymnasium.envs", name="__root__")
    assert point.value == "skate_env.registration:register"
    for name in IDS:
        del gymnasium.registry[name]
    for _ in range(2):
        point.load()()
    assert gymnasium.spec(ID).vector_entry_point == "skate_env.vector:IceSkateVectorEnv"
    assert set(IDS) <= set(gymnasium.registry)


@pytest.mark.parametrize("name", IDS)
def test_the_page_of_a_task_says_from_which_return_it_is_solved(name):
    threshold = gymnasium.spec(name).reward_threshold
    page = re.sub(r"(?<=[a-z])(?=[A-Z])", "-", name.removeprefix("IceSkate")).lower().strip("-")
    text = (ROOT / "docs" / f"iceskate-{page}.md").read_text(encoding="utf-8")
    assert f"mean return of {threshold:g} over 100 episodes" in " ".join(text.split())


def test_spawned_workers_make_the_environment():
    """Gymnasium's AsyncVectorEnv and Stable-Baselines3's SubprocVecEnv start such processes."""
    context = multiprocessing.get_context("spawn")
    with context.Pool(1) as pool:
        name = [pool.apply(gymnasium.make, (each,)).spec.id for each in IDS]
    assert name == list(IDS)


@pytest.mark.parametrize("package", [None, "raise SystemError('damaged')", "this is no Python"])
def test_a_damaged_package_leaves_gymnasium_as_it_is(tmp_path, package):
    """The start-up file remains while the package is missing or broken."""
    shutil.copy(ROOT / "startup" / "purelib" / STARTUP, tmp_path)
    if package is not None:
        (tmp_path / "skate_env").mkdir()
        (tmp_path / "skate_env" / "__init__.py").write_text(package, encoding="utf-8")
    missing = "sys.modules['skate_env'] = None" if package is None else ""
    code = f"""
import sys, site
sys.meta_path[:] = [finder for finder in sys.meta_path if type(finder).__name__ != "Finder"]
sys.path.insert(0, {str(tmp_path)!r})
{missing}
site.addsitedir({str(tmp_path)!r})
assert type(sys.meta_path[0]).__name__ == "Finder"
import gymnasium
assert "IceSkate-v0" not in gymnasium.registry
assert "CartPole-v1" in gymnasium.registry
"""
    python(code)


def test_the_installed_start_up_line_is_that_of_the_source():
    line = (ROOT / "startup" / "purelib" / STARTUP).read_bytes()
    installed = [Path(path) / STARTUP for path in sys.path if (Path(path) / STARTUP).exists()]
    assert installed and installed[0].read_bytes() == line
