"""Imports of the package point downwards, and a folder is imported by its own name."""

import ast
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
# From the top to the bottom. A name without a folder is a module.
LAYERS = (
    ("__main__",),
    ("cli",),
    ("studies",),
    ("learning",),
    ("torch", "sb3", "env", "vector", "policy"),
    ("gait",),
    ("replay",),
    ("policies",),
    ("environments",),
    ("render", "gradients"),
    ("scenes",),
    ("common",),
    ("registration", "_core"),
)
FLOOR = {name: i for i, names in enumerate(reversed(LAYERS)) for name in names}
# Their parts need different libraries, or serve one command each: they are imported one by one.
OPEN = ("studies", "learning", "cli")


def imports(path: Path) -> Iterator[str]:
    """Yield what a module of the repository imports from the repository, with dots."""
    package = list(path.relative_to(ROOT).with_suffix("").parts[:-1])
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            start = package[: len(package) - node.level + 1] if node.level else []
            base = [*start, *(node.module or "").split(".")] if node.module else start
            yield from (".".join([*base, alias.name]) for alias in node.names)


def files(folder: str) -> list[Path]:
    return sorted((ROOT / folder).rglob("*.py"))


def is_module(name: str) -> bool:
    path = ROOT / name.replace(".", "/")
    return path.is_dir() or path.with_suffix(".py").exists()


def test_every_part_has_a_layer():
    parts = {path.relative_to(ROOT).parts[1].removesuffix(".py") for path in files("skate_env")}
    assert parts - {"__init__"} <= set(FLOOR)


@pytest.mark.parametrize("path", files("skate_env"), ids=lambda path: str(path.relative_to(ROOT)))
def test_imports_point_downwards(path):
    here = path.relative_to(ROOT / "skate_env").with_suffix("").parts[0]
    for name in imports(path):
        top, *parts = name.split(".")
        assert top not in ("training", "tests"), f"{name}: the package imports no research"
        if top != "skate_env" or here == "__init__" or not parts or parts[0] == here:
            continue
        assert FLOOR[parts[0]] < FLOOR[here], f"{name} is not below {here}"
        inside = len(parts) > 2 and is_module(".".join([top, *parts[:2]]))
        assert not inside or parts[0] in OPEN, f"{name}: import it from skate_env.{parts[0]}"
