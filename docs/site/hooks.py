"""Hooks of MkDocs: pages from outside `docs`, links between them, and the page of the engine."""

import sys
from pathlib import Path
from typing import Any

from mkdocs.exceptions import PluginError
from mkdocs.structure.files import File, Files

HERE = Path(__file__).parent
sys.path.insert(0, str(HERE))

import content  # noqa: E402 (a file beside this one)

# The page with the engine, where `make web` has built it.
WEB = content.ROOT / "skate_env" / "web"


def on_config(config: Any) -> None:
    """Add the page with the engine to the navigation."""
    if (WEB / "index.html").exists():
        config.nav.append({"Play": "play/index.html"})


def on_files(files: Files, config: Any) -> Files:
    """Add the pages that are not in `docs`."""
    for place, text in content.pages().items():
        files.append(File.generated(config, place, content=text))
    style = HERE / "site.css"
    files.append(File.generated(config, "site.css", abs_src_path=str(style)))
    for path in sorted(WEB.rglob("*")):
        if path.is_file():
            place = f"play/{path.relative_to(WEB).as_posix()}"
            files.append(File.generated(config, place, abs_src_path=str(path)))
    return files


def on_page_markdown(markdown: str, page: Any, **_: Any) -> str:
    """Replace the links of the pages in `docs`."""
    if page.file.generated_by:
        return markdown
    return content.linked(markdown, f"docs/{page.file.src_uri}")


def on_post_build(config: Any) -> None:
    """Check that the reference has every public name."""
    folder = Path(config.site_dir) / "reference"
    text = "".join(path.read_text(encoding="utf-8") for path in folder.glob("*.html"))
    missing = [name for name in content.public() if f'id="{name}"' not in text]
    if missing:
        raise PluginError(f"the reference lacks {', '.join(missing)}")
