"""Show that every hard case fails when the mechanism it tests is removed.

Run it with ``make mutations``. It builds a copy of the engine for every entry of mutations.toml and
runs the cases that must fail; before that they must pass with nothing removed. It needs cargo,
Python 3.11 and about five minutes, and fails if a case does not notice its mutation.
"""

import argparse
import json
import os
import shutil
import subprocess
import sys
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import tomllib
from tqdm import tqdm

ROOT = Path(__file__).parents[2]
MUTATIONS = Path(__file__).with_name("mutations.toml")
WORK = ROOT / "target" / "mutants"
# Mutated copy of the sources; its build folder; the unmutated module.
TREE, BUILD, WHOLE = WORK / "tree", WORK / "build", WORK / "whole.so"
MODULE = TREE / "skate_env" / "_core.abi3.so"
SOURCES = ("Cargo.toml", "Cargo.lock", "rust", "skate_env")
# About as fast as a release build for cases of a few seconds, and built in seconds.
PROFILE = {"opt-level": "2", "debug": "false", "debug-assertions": "false"}
LONGEST = 60.0
"""A case that takes longer hangs [s]."""


@dataclass(frozen=True)
class Edit:
    """An edit: a piece of a source and its replacement."""

    file: str
    old: str
    new: str


@dataclass(frozen=True)
class Mutation:
    """A removed mechanism, and the cases that must fail."""

    name: str
    edits: tuple[Edit, ...]
    fails: tuple[str, ...]
    method: str = "balanced"

    @property
    def files(self) -> list[str]:
        """Edited files, each once."""
        return list(dict.fromkeys(edit.file for edit in self.edits))


@dataclass(frozen=True)
class Verdict:
    """Result of a case."""

    passed: bool
    message: str
    """What it measured, or why it has no number."""


def mutations() -> list[Mutation]:
    """Read mutations.toml: an entry has its own edit, and further edits under `also`."""
    entries = tomllib.loads(MUTATIONS.read_text(encoding="utf-8"))["mutation"]
    read = []
    for entry in entries:
        edits = [Edit(entry.pop("file"), entry.pop("old"), entry.pop("new"))]
        edits += [Edit(**edit) for edit in entry.pop("also", [])]
        fails = tuple(entry.pop("fails"))
        read.append(Mutation(edits=tuple(edits), fails=fails, **entry))
    return read


def main() -> None:
    """Run from the command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--only", metavar="NAME", action="append", help="only this mutation")
    parser.add_argument("--out", metavar="FOLDER", type=Path, help="folder for mutations.md")
    given = parser.parse_args()
    chosen = [m for m in mutations() if not given.only or m.name in given.only]
    if not chosen:
        parser.error(f"--only {given.only}: known are {', '.join(m.name for m in mutations())}")
    unmutated = check_unmutated(chosen)
    if unmutated:
        sys.exit(f"fail with nothing removed: {unmutated}")
    with tqdm(chosen, unit="mutation", file=sys.stderr) as bar:
        found = {mutation: verdicts(mutation, bar) for mutation in bar}
    table = markdown(found)
    print(table)
    if given.out is not None:
        given.out.mkdir(parents=True, exist_ok=True)
        (given.out / "mutations.md").write_text(table, encoding="utf-8")
    missed = [
        f"{mutation.name}: {case} passes"
        for mutation, cases in found.items()
        for case, verdict in cases.items()
        if verdict.passed
    ]
    if missed:
        sys.exit("\n".join(missed))


def check_unmutated(chosen: Sequence[Mutation]) -> list[str]:
    """Build without mutations; return the cases that fail, and why."""
    sync()
    build()
    shutil.copy(MODULE, WHOLE)
    pairs = dict.fromkeys((case, mutation.method) for mutation in chosen for case in mutation.fails)
    failures = []
    with tqdm(pairs, unit="case", desc="unmutated", file=sys.stderr) as bar:
        for case, method in bar:
            verdict = run(case, method)
            if not verdict.passed:
                failures.append(f"{case} at {method}: {verdict.message}")
    return failures


def verdicts(mutation: Mutation, bar: tqdm) -> dict[str, Verdict]:
    """Apply a mutation and run its cases."""
    bar.set_description(mutation.name[:40].ljust(40))
    sync()
    for edit in mutation.edits:
        path = TREE / edit.file
        source = path.read_text(encoding="utf-8")
        if source.count(edit.old) != 1:
            sys.exit(f"{mutation.name}: {edit.file} does not hold the old text exactly once")
        path.write_text(source.replace(edit.old, edit.new), encoding="utf-8")
    if any(file.startswith("rust/") for file in mutation.files):
        build()
    else:
        shutil.copy(WHOLE, MODULE)
    return {case: run(case, mutation.method) for case in mutation.fails}


def sync() -> None:
    """Update the copy from the sources; unchanged files keep their dates for cargo."""
    wanted = {path.relative_to(ROOT) for name in SOURCES for path in _files(ROOT / name)}
    for name in wanted:
        copy, data = TREE / name, (ROOT / name).read_bytes()
        if not copy.exists() or copy.read_bytes() != data:
            copy.parent.mkdir(parents=True, exist_ok=True)
            copy.write_bytes(data)
    for path in _files(TREE):
        if path.relative_to(TREE) not in wanted:
            path.unlink()


def _files(path: Path) -> Iterator[Path]:
    """All sources below a path, without compiled modules."""
    every: Iterable[Path] = path.rglob("*") if path.is_dir() else [path]
    for file in every:
        if file.is_file() and file.suffix not in (".so", ".pyd", ".pyc"):
            yield file


def build() -> None:
    """Build the bindings of the copy; a mutation that does not compile is an error."""
    settings = [f"--config=profile.dev.{key}={value}" for key, value in PROFILE.items()]
    done = subprocess.run(
        ["cargo", "build", "--package=skate-py", "--features=pyo3/extension-module", *settings],
        cwd=TREE,
        env={**os.environ, "CARGO_TARGET_DIR": str(BUILD), "PYO3_PYTHON": sys.executable},
        capture_output=True,
        text=True,
        check=False,
    )
    if done.returncode:
        sys.exit(done.stderr)
    built = [BUILD / "debug" / name for name in ("lib_core.so", "lib_core.dylib", "_core.dll")]
    shutil.copy(next(path for path in built if path.exists()), MODULE)


def run(case: str, method: str) -> Verdict:
    """Run a case in a separate process, which may hang or crash."""
    command = [sys.executable, "-m", "skate_env", "hardcases", "--json"]
    try:
        done = subprocess.run(
            [*command, f"--case={case}", f"--method={method}"],
            cwd=TREE,
            env={**os.environ, "PYTHONPATH": str(TREE), "PYTHONDONTWRITEBYTECODE": "1"},
            capture_output=True,
            text=True,
            check=False,
            timeout=LONGEST,
        )
    except subprocess.TimeoutExpired:
        return Verdict(False, f"stopped after {LONGEST:.0f} s")
    try:
        (result,) = json.loads(done.stdout.splitlines()[-1])["results"]
    except (IndexError, ValueError):
        last = (done.stderr.strip().splitlines() or ["no output"])[-1]
        return Verdict(False, f"exit status {done.returncode}: {last}")
    measured, limit = result["measured"], result["limit"]
    message = result["reason"] or f"{measured:.3g}, limit {limit:.3g}"
    return Verdict(result["passed"], message)


def markdown(found: dict[Mutation, dict[str, Verdict]]) -> str:
    """Format the results as a table: a row per mutation, a line per case."""
    lines = ["| removed | where | cases that fail, and what they measure |", "|---|---|---|"]
    for mutation, cases in found.items():
        where = "<br>".join(f"`{file.removeprefix('rust/')}`" for file in mutation.files)
        at = "" if mutation.method == "balanced" else f" at `{mutation.method}`"
        results = [
            f"`{case}`{at}: {'**passes**, ' if verdict.passed else ''}{_cell(verdict.message)}"
            for case, verdict in cases.items()
        ]
        lines.append(f"| {_cell(mutation.name)} | {where} | {'<br>'.join(results)} |")
    return "\n".join(lines) + "\n"


def _cell(text: str) -> str:
    """Shorten a text to a readable length for a table cell."""
    text = " ".join(text.split()).replace("|", "\\|").replace("<", "&lt;")
    return text if len(text) <= 120 else f"{text[:117]}..."


if __name__ == "__main__":
    main()
