"""Licences of everything that the wheel and the page contain.

``python -m tests.licences`` writes them; it needs the locked crates of cargo, and web/node_modules.
"""

import json
import re
import subprocess
from collections import defaultdict
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[1]
FILE = ROOT / "docs" / "third-party-licences.txt"
MODULES = ROOT / "web/node_modules"
# Crates of the wheels and of the page: manifest, name, platforms.
BUILDS = (
    (
        *("Cargo.toml", "skate-py"),
        ("x86_64-unknown-linux-gnu", "aarch64-apple-darwin", "x86_64-pc-windows-msvc"),
    ),
    ("rust/skate-web/Cargo.toml", "skate-web", ("wasm32-unknown-unknown",)),
)
HEAD = """\
Licences of what the packages and the page of IceSkate contain besides its own code, whose licence
is in LICENSE. Rust's standard library, Copyright (c) The Rust Project Contributors, has the licence
that is printed for libc.
"""
_NAMES = re.compile(r"(licen[cs]e|copying|notice|unlicense)", re.IGNORECASE)

# Name, licence and its texts.
Part = tuple[str, str, tuple[str, ...]]


def crates() -> str:
    """Return the licences of the crates in the engine."""
    found = {part for build in BUILDS for part in _linked(*build)}
    return _chapter("the engine", found)


def modules() -> str:
    """Return the licences of the JavaScript libraries in the page."""
    sources = (path.read_text(encoding="utf-8") for path in (ROOT / "web/src").rglob("*.ts"))
    names = {name for text in sources for name in re.findall(r'from "([^".][^"]*)"', text)}
    found = {
        (name, json.loads((MODULES / name / "package.json").read_text())["license"])
        for name in names
    }
    return _chapter("the page", {(*part, _texts(MODULES / part[0], part[1])) for part in found})


def _linked(manifest: str, root: str, platforms: Iterable[str]) -> Iterator[Part]:
    """Return the crates of others that a crate is linked with; macros are not part of it."""
    command = ["cargo", "metadata", "--locked", "--format-version", "1"]
    command += ["--manifest-path", str(ROOT / manifest)]
    command += [f"--filter-platform={platform}" for platform in platforms]
    metadata = json.loads(subprocess.run(command, check=True, stdout=subprocess.PIPE).stdout)
    packages = {package["id"]: package for package in metadata["packages"]}
    nodes = {node["id"]: node for node in metadata["resolve"]["nodes"]}
    left = [each for each, package in packages.items() if package["name"] == root]
    seen = set(left)
    while left:
        used = {dep["pkg"] for dep in nodes[left.pop()]["deps"] if _is_linked(dep, packages)}
        left += used - seen
        seen |= used
    for package in (packages[each] for each in seen):
        if package["source"] is not None:
            folder = Path(package["manifest_path"]).parent
            yield package["name"], package["license"], _texts(folder, package["license"])


def _is_linked(dep: dict[str, Any], packages: dict[str, Any]) -> bool:
    kinds = {kind["kind"] for kind in dep["dep_kinds"]}
    targets = (target["kind"] for target in packages[dep["pkg"]]["targets"])
    return None in kinds and ["proc-macro"] not in targets


def _texts(folder: Path, licence: str) -> tuple[str, ...]:
    """Read the texts of a licence; of alternatives that of MIT, the shortest."""
    files = sorted(path for path in folder.iterdir() if _NAMES.match(path.name))
    short = [path for path in files if "MIT" in path.name or path.name.startswith("NOTICE")]
    if short and "AND" not in licence.split():
        files = short
    if not files:
        raise ValueError(f"{folder}: no text of the licence {licence}")
    lines = (path.read_text(encoding="utf-8").strip().splitlines() for path in files)
    return tuple("\n".join(line.rstrip() for line in text) for text in lines)


def _chapter(of: str, parts: Iterable[Part]) -> str:
    """Return all texts, each once, under the names of the parts that have it."""
    names = defaultdict(set)
    for name, licence, texts in parts:
        names[texts].add(f"{name} ({licence})")
    rule = "=" * 80
    entries = sorted((sorted(users), texts) for texts, users in names.items())
    shown = ["\n".join([rule, *users, rule, "", "\n\n".join(texts)]) for users, texts in entries]
    return "\n\n".join([f"\nIn {of}:", *shown]) + "\n"


if __name__ == "__main__":
    FILE.write_text(HEAD + crates() + modules(), encoding="utf-8")
