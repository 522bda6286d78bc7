"""The pages of the site that are made from others; `make docs` also checks links and names."""

import importlib.util
import json
import re
from importlib import import_module
from pathlib import Path
from types import ModuleType

import gymnasium
import pytest

import skate_env
from skate_env.registration import IDS

ROOT = Path(__file__).parents[1]


@pytest.fixture(scope="module")
def content() -> ModuleType:
    spec = importlib.util.spec_from_file_location("content", ROOT / "docs" / "site" / "content.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_every_id_has_a_page_with_a_film_and_its_own_keywords(content):
    assert list(content.IDS) == list(IDS)
    for name in IDS:
        text = content.pages()[f"environments/{name}.md"]
        assert (ROOT / "docs" / "films" / f"{name}.gif").exists() and f"films/{name}.gif" in text
        given = re.findall(r"^\| `(\w+)` \| `(.+)` \|$", text, re.M)
        assert {key: json.loads(x) for key, x in given} == gymnasium.spec(name).kwargs
        assert "| zero actions |" in text
        (code,) = re.findall(r"^```python\n(.*?)^```", text, re.M | re.S)
        names: dict[str, object] = {}
        exec(compile(code, name, "exec"), names)
        assert names["env"].spec.id == name


def test_the_examples_are_on_one_page(content):
    text = content.pages()["examples.md"]
    for path in (ROOT / "docs" / "examples").glob("*.py"):
        assert f"## {path.name}\n" in text
        assert path.read_text(encoding="utf-8").split('"""', 2)[2].strip() in text


def test_links_lead_to_the_same_files_in_the_site(content):
    text = (
        "[a](docs/accuracy.md#x) [b](docs/examples/ppo.py) [c](https://d) [e](training/README.md)"
    )
    moved = "[a](accuracy.md#x) [b](examples.md#ppopy) [c](https://d) [e](training.md)"
    assert content.linked(text, "README.md") == moved
    assert content.linked("[a](../docs/a.md)", "training/README.md") == "[a](a.md)"
    assert content.linked("[a](../README.md)", "docs/a.md") == "[a](index.md)"


def test_the_reference_has_the_names_of_every_module(content):
    def found(full: str) -> object:
        module, _, name = full.rpartition(".")
        return getattr(import_module(module), name)

    documented = [found(full) for full in content.public()]
    for module in (*content.SAME, "_core", "environments", "policies", "replay", "scenes"):
        there = import_module(f"skate_env.{module}")
        for name in there.__all__:
            assert any(getattr(there, name) is one for one in documented), (module, name)
    index = content.pages()["reference/index.md"]
    assert all(f"| `skate_env.{name}` |" in index for name in skate_env.__all__)
