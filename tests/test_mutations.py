"""Mutations agree with the sources and the catalogue; ``make mutations`` runs them."""

import importlib.util
from pathlib import Path

import pytest

from skate_env.studies.hardcases.catalogue import CASES

pytest.importorskip("tomllib", reason="Python 3.11 is the first to read TOML")
ROOT = Path(__file__).parents[1]


def _mutations():
    path = ROOT / "tests" / "campaigns" / "mutate.py"
    spec = importlib.util.spec_from_file_location("mutate", path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module.mutations()


MUTATIONS = _mutations()


@pytest.mark.parametrize("mutation", MUTATIONS, ids=lambda mutation: mutation.name)
def test_a_mutation_changes_one_place_and_names_cases(mutation):
    for edit in mutation.edits:
        source = (ROOT / edit.file).read_text(encoding="utf-8")
        assert source.count(edit.old) == 1, f"{edit.file}: {edit.old}"
        assert edit.new != edit.old
    assert mutation.fails
    for case in mutation.fails:
        assert mutation.method in CASES[case].limits


def test_no_two_mutations_have_one_name():
    names = [mutation.name for mutation in MUTATIONS]
    assert len(set(names)) == len(names)


def test_every_case_has_a_mutation():
    listed = {case for mutation in MUTATIONS for case in mutation.fails}
    assert set(CASES) - listed == set()
