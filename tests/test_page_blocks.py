"""Blocks of the pages that are no Python of the package: commands, scene files, other libraries."""

import re
import shlex
import warnings
from pathlib import Path

import pytest
import typer

from skate_env import Scene
from skate_env.cli import app

ROOT = Path(__file__).parents[1]
PAGES = [*ROOT.glob("*.md"), *(ROOT / "docs").glob("*.md"), *(ROOT / "training").rglob("*.md")]
PAGES = [page for page in PAGES if page.name != "CHANGELOG.md"]


def blocks(page: Path, *kinds: str) -> list[str]:
    """Blocks of a page that begin with one of these words, or with none."""
    found = re.findall(r"^```(\w*)\n(.*?)^```", page.read_text(encoding="utf-8"), re.M | re.S)
    return [text for kind, text in found if kind in kinds]


def commands() -> list[str]:
    """Lines of blocks that are commands, without comments; a line may go on after a backslash."""
    lines = []
    for page in PAGES:
        for block in blocks(page, "", "sh"):
            lines += re.sub(r"\\\n *", "", block).splitlines()
    return sorted({re.sub(r"(^|  +)#.*$", "", line).strip() for line in lines})


def named(word: str) -> list[str]:
    return [line for line in commands() if line.startswith(f"{word} ")]


@pytest.mark.parametrize("line", named("skate-env"))
def test_commands_of_the_pages_have_these_options(line):
    _, name, *arguments = shlex.split(line)
    command = typer.main.get_command(app).commands[name]
    if "--verify" in arguments:
        # This option reads its file at once: names only.
        command.make_parser(typer.Context(command)).parse_args(arguments)
    else:
        # Reads names, types and ranges of the arguments; nothing runs.
        command.make_context(name, arguments)


@pytest.mark.parametrize("line", named("python"))
def test_programs_of_the_pages_exist(line):
    words = shlex.split(line)[1:]
    # Modules are not imported: some libraries change others when they are.
    path = ROOT / (words[1].replace(".", "/") if words[0] == "-m" else words[0])
    own = path.relative_to(ROOT).parts[0] in ("docs", "skate_env", "tests", "training")
    assert not own or path.exists() or path.with_suffix(".py").exists(), line


def test_targets_of_make_exist():
    makefile = (ROOT / "Makefile").read_text(encoding="utf-8")
    texts = [page.read_text(encoding="utf-8") for page in PAGES]
    targets = {x for text in texts for x in re.findall(r"(?:`|^)make ([a-z][a-z-]*)", text, re.M)}
    assert len(targets) > 8
    for target in targets:
        assert re.search(rf"^{target}:", makefile, re.M), target


@pytest.mark.parametrize("name", ["accuracy.md", "effects.md"])
def test_scene_files_of_the_pages_are_valid(name):
    found = blocks(ROOT / "docs" / name, "toml")
    assert len(found) == 4
    for text in found:
        Scene.from_toml('name = "some"\n' + text)


@pytest.mark.parametrize("page", ["docs/gradients.md", "training/README.md"])
def test_examples_with_other_libraries_run(page):
    kind = "py" if page == "docs/gradients.md" else "python"
    pytest.importorskip("stable_baselines3")
    (code,) = blocks(ROOT / page, kind)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        exec(compile(code, page, "exec"), {})
