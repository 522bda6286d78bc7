"""Pages of the site that are made from others: environments, examples, reference, links."""

import ast
import json
import posixpath
import re
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[2]
# Pages outside the folder `docs`, and their places in the site.
OUTSIDE = {
    "README.md": "index.md",
    "CHANGELOG.md": "CHANGELOG.md",
    "CONTRIBUTING.md": "CONTRIBUTING.md",
    "SECURITY.md": "SECURITY.md",
    "training/README.md": "training.md",
    "training/gaits/README.md": "gait-search.md",
}
IDS = ("IceSkate-v0", "IceSkatePushOnly-v0", "IceSkateAnyIce-v0")
NOTEBOOKS = ROOT / "docs" / "notebooks"
# Names of each page of the reference.
REFERENCE = {
    "simulator": ["skate_env.Simulator", "skate_env._core"],
    "scenes": ["skate_env.scenes"],
    "environments": ["skate_env.environments", "skate_env.sb3.IceSkateVecEnv"],
    "policies": ["skate_env.policies", "skate_env.policies.baseline"],
    "replays": ["skate_env.replay", "skate_env.render"],
    "gradients": ["skate_env.gradients", "skate_env.torch"],
    "gaits": ["skate_env.gait"],
}


# Modules whose names are documented where they are imported from.
SAME = ("env", "policy", "vector")


def read(path: str) -> str:
    """Return the text of a file of the repository."""
    return (ROOT / path).read_text(encoding="utf-8")


def pages() -> dict[str, str]:
    """Return the text of every page that is not a file of `docs`, by its place in the site."""
    made = {place: linked(read(source), source) for source, place in OUTSIDE.items()}
    made |= {f"environments/{name}.md": environment(name) for name in IDS}
    made |= {f"reference/{name}.md": reference(name) for name in REFERENCE}
    made |= {f"notebooks/{path.stem}.md": notebook(path) for path in NOTEBOOKS.glob("*.ipynb")}
    return made | {"examples.md": examples(), "reference/index.md": index()}


def linked(text: str, source: str) -> str:
    """Replace the links of a page by those of the site; ``source`` is its file."""
    place = OUTSIDE.get(source, source.removeprefix("docs/"))

    def link(found: re.Match[str]) -> str:
        target, _, heading = found[1].partition("#")
        if not target or ":" in target:
            return found[0]
        file = posixpath.normpath(posixpath.join(posixpath.dirname(source), target))
        if file.startswith("docs/examples"):
            name = posixpath.basename(file)
            file, heading = "examples.md", heading or (name.replace(".", "") if "." in name else "")
        to = OUTSIDE.get(file, file.removeprefix("docs/"))
        to = posixpath.relpath(to, posixpath.dirname(place) or ".")
        return f"]({to}{'#' if heading else ''}{heading})"

    return re.sub(r"\]\(([^)\s]+)\)", link, text)


def column(path: str, head: str, name: str) -> list[tuple[str, str]]:
    """Return first cell and cell of a column, for the rows of the table whose head begins so."""
    table = re.search(rf"^\| {head} \|.*?(?:\n(?!\|)|\Z)", read(path), re.M | re.S)
    assert table, f"{path}: no table {head}"
    rows = [[cell.strip() for cell in row[1:-1].split("|")] for row in table[0].strip().split("\n")]
    at = rows[0].index(f"`{name}`")
    return [(row[0], row[at]) for row in rows[2:] if row[at]]


def environment(name: str) -> str:
    """Return the page of an id: film, keywords and returns from other pages."""
    keywords = column("docs/iceskate-v0.md", "keyword", name)
    returns = column("README.md", "return, steps, distance, goal", name)
    page = "../iceskate-v0.md"
    return f"""# {name}

![The learned policy of {name}](../films/{name}.gif)

```python
import gymnasium

env = gymnasium.make("skate_env:{name}")
```

[Description]({page}#description) ·
[actions]({page}#action-space) ·
[observations]({page}#observation-space) ·
[rewards]({page}#rewards) ·
[starts]({page}#starting-state) ·
[end of an episode]({page}#episode-end) ·
[keywords]({page}#arguments)

| keyword | default of this id |
|---|---|
{rows(keywords)}

| controller | return, steps, distance, [goal](../index.md#use) |
|---|---|
{rows(returns)}

[Benchmark](../generated/benchmark.md) · [learned policies](../learned-policies.md)
"""


def rows(cells: list[tuple[str, str]]) -> str:
    """Return the rows of a table."""
    return "\n".join(f"| {' | '.join(row)} |" for row in cells)


def examples() -> str:
    """Return the page of all examples: what each does, and its code."""
    text = "# Examples\n"
    for path in sorted((ROOT / "docs" / "examples").glob("*.py")):
        code = path.read_text(encoding="utf-8")
        about = ast.get_docstring(ast.parse(code))
        assert about, path
        rest = code.split('"""', 2)[2].strip()
        text += f"\n## {path.name}\n\n{about}\n\n```python\n{rest}\n```\n"
    return text


def notebook(path: Path) -> str:
    """Return the page of a notebook: its texts, its code and the stored outputs."""
    text = ""
    for cell in json.loads(path.read_text(encoding="utf-8"))["cells"]:
        source = "".join(cell["source"])
        code = cell["cell_type"] == "code"
        text += f"```python\n{source}\n```\n\n" if code else f"{source}\n\n"
        for output in cell.get("outputs", []):
            data = output.get("data", {})
            if "image/png" in data:
                picture = "".join(data["image/png"]).replace("\n", "")
                text += f"![Output](data:image/png;base64,{picture})\n\n"
            elif said := "".join(output.get("text", data.get("text/plain", ""))):
                text += f"```text\n{said.rstrip()}\n```\n\n"
    return text


def literal(path: str, name: str) -> Any:
    """Return the value of a constant of a module, or None."""
    for node in ast.parse(read(path)).body:
        if isinstance(node, ast.Assign) and ast.unparse(node.targets[0]) == name:
            return ast.literal_eval(node.value)
    return None


def public() -> list[str]:
    """Return the full names that the reference must have: those in the ``__all__`` of a module."""
    modules = {path.parent.name: path for path in (ROOT / "skate_env").glob("*/__init__.py")}
    modules |= {path.stem: path for path in (ROOT / "skate_env").glob("*.py*")}
    names = []
    for module, path in sorted(modules.items()):
        if module not in (*SAME, "__init__", "common"):
            given = literal(str(path.relative_to(ROOT)), "__all__") or ()
            names += [f"skate_env.{module}.{name}" for name in given]
    return names


def index() -> str:
    """Return the first page of the reference: the names of `skate_env`, linked."""
    names = literal("skate_env/__init__.py", "_MODULES")
    named = {"Simulator": "skate_env.Simulator"}
    named |= {name: f"skate_env.{module}.{name}" for name, module in names.items()}
    shown = [(f"`skate_env.{name}`", f"[{to}][]") for name, to in sorted(named.items())]
    return f"# Reference\n\n| name | text |\n|---|---|\n{rows(shown)}\n"


def reference(name: str) -> str:
    """Return a page of the reference, which mkdocstrings fills; searches show it last."""
    head = f"---\nsearch:\n  boost: 0.01\n---\n\n# {name.capitalize()}\n\n"
    return head + "".join(f"::: {each}\n\n" for each in REFERENCE[name])
