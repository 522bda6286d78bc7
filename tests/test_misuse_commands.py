"""Every number of a command has a finite range, and wrong values end the command."""

import importlib
import inspect
import os
import subprocess
import sys
import typing
from importlib.util import find_spec
from pathlib import Path

import pytest
import typer

from skate_env import cli
from skate_env.cli import app, options
from tests.commands import invoke

FUNCTIONS = [command.callback for command in app.registered_commands]
# Their libraries are not part of the quick tier.
if find_spec("cma"):
    FUNCTIONS.append(importlib.import_module("training.gaits.search").main)
if find_spec("ray"):
    FUNCTIONS.append(importlib.import_module("training.benchmark.rllib").main)


def numbers():
    """All options that are numbers: command, parameter, its type and its option."""
    for function in FUNCTIONS:
        hints = typing.get_type_hints(function, include_extras=True)
        for name in inspect.signature(function).parameters:
            kind = (getattr(hints[name], "__metadata__", None) or (None,))[0]
            base = typing.get_args(hints[name])[:1]
            bases = {*base, *(typing.get_args(base[0]) if base else ())}
            if found := bases & {int, float}:
                yield function.__name__, name, found.pop(), kind


@pytest.mark.parametrize(("command", "name", "kind", "option"), list(numbers()))
def test_every_number_has_a_finite_range(command, name, kind, option):
    assert option.min is not None and option.max is not None
    assert abs(option.min) < 2**64 and abs(option.max) < 2**64
    if kind is float:
        with pytest.raises(typer.BadParameter):
            option.callback(float("nan"))


def paths():
    """All options that are paths: command, parameter, and its option."""
    for function in FUNCTIONS:
        for name, hint in typing.get_type_hints(function, include_extras=True).items():
            base = typing.get_args(hint)[:1]
            if Path in {*base, *(typing.get_args(base[0]) if base else ())}:
                yield function.__name__, name, hint.__metadata__[0]


@pytest.mark.parametrize(("command", "name", "option"), list(paths()))
def test_no_path_is_empty(command, name, option):
    assert option.parser is options.path
    with pytest.raises(typer.BadParameter):
        option.parser("")


WRONG = [
    ("gait", "--out", ""),
    ("orbit", "--feedback", ""),
    *(("record", "--out", "a.gif", "--slow", x) for x in ("inf", "nan", "-inf", "1e300", "0")),
    *(("record", "--out", "a.gif", "--fps", x) for x in ("inf", "nan", "-1")),
    *(("record", "--out", "a.gif", "--perturb", x) for x in ("inf", "nan", "11")),
    *(("record", "--out", "a.gif", "--seed", x) for x in (2**64, -1, 10**30)),
    *(("record", "--out", "a.gif", "--steps", x) for x in (2**64, 0)),
    ("record", "--out", "a.gif", "--size", "999999x999999"),
    ("record", "--out", "a\0.gif"),
    ("replay", "--out", "a", "--steps", 10**30),
    ("replay", "--out", "a", "--perturb", "nan"),
    ("replay", "--out", "a", "--set", "x=" + 20_000 * "["),
    ("replay", "--out", "a", "--set", "control.feedforward=" + 20_000 * "[" + 20_000 * "]"),
    ("replay", "--out", "a", "--set", "control.feedforward=" + 400 * "[" + 400 * "]"),
    ("replay", "--out", "a", "--set", "control.feedforward=" + 400 * '{"a":' + "1" + 400 * "}"),
    ("replay", "--out", "a", "--set", "ice.friction.mu_forward=" + 5000 * "1"),
    ("replay", "--out", "a", "--accuracy", '{"method": "rk4", "step": 1e-3, "step": 1e-4}'),
    ("replay", "--out", "a", "--set", "ice.friction.mu_forward=1e999"),
    ("replay", "--out", "a", "--accuracy", 20_000 * "["),
    ("replay", "--out", "a", "--scene", "a\0.toml"),
    ("replay", "--out", "a", "--scene", 10_000 * "a" + ".toml"),
    ("replay", "--out", "a", "--policy", "/dev/zero"),
    ("replay", "--out", 10_000 * "a", "--steps", 1),
    ("replay", "--out", "a\0", "--steps", 1),
    ("stress", "--steps", "1e3"),
    ("stress", "--jobs", 10**9),
    ("stress", "--episode", 10**30),
    ("stress", "--seed", 10**30),
    ("stress", "--accuracy", 20_000 * "["),
]


@pytest.mark.parametrize("arguments", WRONG, ids=lambda given: " ".join(map(str, given))[:60])
def test_wrong_values_end_a_command_with_a_message(arguments, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    result = invoke(*arguments)
    assert result.exit_code == 2 and "rror" in result.output, (result.output, result.exception)
    # The message may repeat the given name.
    assert len(result.output) < 15_000
    assert not [path for path in tmp_path.rglob("*") if path.is_file()]


def test_a_gif_that_does_not_fit_into_memory_is_refused(tmp_path, monkeypatch):
    monkeypatch.setattr("skate_env.replay.film._GIF_MEMORY", 3 * 320 * 200 * 5)
    result = invoke("record", "--size", "320x200", "--out", tmp_path / "a.gif")
    assert result.exit_code == 2 and "at most 5 frames" in result.output
    assert not list(tmp_path.iterdir())


def test_the_handler_of_sigterm_exits_with_the_shells_status():
    with pytest.raises(SystemExit) as exit:
        cli._exit(15, None)
    assert exit.value.code == 143


@pytest.mark.parametrize("target", ["/dev/full", "/proc", "/proc/no"])
@pytest.mark.parametrize("option", ["--feedback", "--out"])
def test_targets_are_checked_before_an_orbit_is_computed(option, target, monkeypatch):
    study = pytest.importorskip("training.orbits.study", exc_type=ImportError)
    monkeypatch.setattr(study, "study", lambda *_: pytest.fail("it is computed"))
    result = invoke("orbit", option, target)
    assert result.exit_code == 2 and "error: " in result.output


OUTPUTS = [("scenes",), ("hardcases", "--list"), ("effects", "--list"), ("--help",)]


@pytest.mark.parametrize("arguments", OUTPUTS, ids=" ".join)
def test_output_that_cannot_be_written_is_an_error(arguments):
    # What is buffered is written once more when Python ends.
    environment = {name: x for name, x in os.environ.items() if name != "PYTHONUNBUFFERED"}
    command = [sys.executable, "-m", "skate_env", *arguments]
    with Path("/dev/full").open("w") as full:
        done = subprocess.run(
            command, stdout=full, stderr=subprocess.PIPE, env=environment, text=True, timeout=100
        )
    assert done.returncode == 2
    assert done.stderr == "error: [Errno 28] No space left on device\n"


@pytest.mark.parametrize("arguments", OUTPUTS[:3], ids=" ".join)
def test_a_closed_pipe_is_no_error(arguments):
    reader, writer = os.pipe()
    os.close(reader)
    command = [sys.executable, "-m", "skate_env", *arguments]
    done = subprocess.run(command, stdout=writer, stderr=subprocess.PIPE, text=True, timeout=100)
    os.close(writer)
    assert (done.returncode, done.stderr) == (1, "")
