"""The licences of wheel and page are complete and part of both."""

import shutil
from importlib.metadata import distribution

import pytest

from skate_env.replay import page
from tests import licences

TEXT = licences.FILE.read_text(encoding="utf-8")


@pytest.mark.skipif(shutil.which("cargo") is None, reason="needs cargo")
def test_they_are_those_of_the_locked_crates():
    """Run ``make licences`` where the locked crates have changed."""
    assert licences.crates() in TEXT


@pytest.mark.skipif(not licences.MODULES.exists(), reason="needs web/node_modules: make web")
def test_they_are_those_of_the_libraries_in_the_page():
    assert TEXT.endswith(licences.modules())


def test_they_are_part_of_the_package():
    package = distribution("skate-env")
    assert package.metadata.get_all("License-File") == ["LICENSE", f"docs/{licences.FILE.name}"]
    assert package.read_text(f"licenses/docs/{licences.FILE.name}") == TEXT


@pytest.mark.skipif(not page.FOLDER.exists(), reason="the page is not built: make web")
def test_they_are_part_of_the_page():
    assert (page.FOLDER / "licences.txt").read_text(encoding="utf-8") == TEXT
    assert 'href="licences.txt"' in (page.FOLDER / "index.html").read_text(encoding="utf-8")
    for file in ("player.html", "assets/index-*.js"):
        (found,) = page.FOLDER.glob(file)
        assert "three.js authors" in found.read_text(encoding="utf-8")
