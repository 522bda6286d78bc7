"""What several test files share."""

import json
import os
import warnings
from collections.abc import Callable
from typing import Any

import gymnasium
import pytest

from skate_env import Scene, load_scene
from skate_env.scenes import replace

# Windows that the tests open are seen by nobody, also where there is no display.
os.environ["SDL_VIDEODRIVER"] = "dummy"


def pytest_configure() -> None:
    """Refuse another Gymnasium than the one that ``make test`` names."""
    asked, found = os.environ.get("GYMNASIUM", ""), gymnasium.__version__
    if not found.startswith(asked):
        raise pytest.UsageError(f"Gymnasium {asked} is to be tested, but this is {found}")


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Begin with the longest tests, so that all workers end together."""
    items.sort(key=lambda item: item.path.stem != "test_vector_bits")


@pytest.fixture(scope="session")
def paper() -> Callable[..., Scene]:
    """Preset `paper` with changes, its start without the joints that they lock."""

    def make(**changes: Any) -> Scene:
        scene = load_scene("paper")
        locked = changes.get("locked", [])
        start = json.loads(scene.to_json())["start"]
        for part in ("q", "v"):
            start[part] = {name: x for name, x in start[part].items() if name not in locked}
        return replace(scene, {"start": start, **changes})

    return make


@pytest.fixture(scope="session")
def refused() -> Callable[..., None]:
    """Expect an exception of that very kind whose message has all words; no warning will do."""

    def expect(kind: type[Exception], call: Callable[[], Any], *words: str) -> None:
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            with pytest.raises(kind) as refusal:
                call()
        assert type(refusal.value) is kind, repr(refusal.value)
        message = str(refusal.value)
        for word in words:
            assert word in message, (word, message)
        assert len(message) < 2000

    return expect
