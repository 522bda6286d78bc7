"""Films: the command ``skate-env record``."""

import sys

import imageio_ffmpeg
import numpy as np
import pytest
from PIL import Image
from typer.testing import CliRunner

from skate_env import Simulator
from skate_env.cli import app
from skate_env.render import Renderer


def run(*arguments):
    return CliRunner().invoke(app, ["record", *map(str, arguments)])


def film(*arguments):
    result = run("--size", "320x200", *arguments)
    assert result.exit_code == 0, result.output
    return result


def gif(path):
    """Durations of a GIF's frames [s]."""
    with Image.open(path) as image:
        durations = []
        for i in range(image.n_frames):
            image.seek(i)
            durations.append(image.info["duration"] / 1000)
        return durations


def frames_until(time, rate):
    """Return the number of frames from the start to the first one at or after a time."""
    return int(np.ceil(time * rate - 1e-9)) + 1


def step_time():
    """Time of the end of the first gait step of `paper`, in whole actions."""
    sim = Simulator("paper")
    while not sim.take_steps():
        sim.step()
    return sim.time


@pytest.mark.parametrize(("slow", "fps"), [(1, 50), (4, 25), (0.5, 30)])
def test_an_mp4_takes_as_long_as_the_motion(tmp_path, slow, fps):
    out = tmp_path / "film.mp4"
    film("--steps", 1, "--slow", slow, "--fps", fps, "--out", out)
    frames, seconds = imageio_ffmpeg.count_frames_and_secs(str(out))
    assert frames == frames_until(step_time(), slow * fps)
    # The file's duration has a resolution of 0.01 s.
    assert seconds == pytest.approx(frames / fps, abs=0.011)


@pytest.mark.parametrize("fps", [10, 30, 50])
def test_a_gif_takes_as_long_as_the_motion(tmp_path, fps):
    out = tmp_path / "film.gif"
    film("--steps", 1, "--fps", fps, "--out", out)
    durations = gif(out)
    assert len(durations) == frames_until(step_time(), fps)
    # GIF durations are multiples of 0.01 s; their rounding errors do not accumulate.
    assert sum(durations) == pytest.approx(len(durations) / fps, abs=0.0051)
    assert max(durations) - min(durations) <= 0.0101


def test_a_films_pictures_are_the_renderers(tmp_path):
    out = tmp_path / "film.gif"
    film("--steps", 2, "--fps", 10, "--out", out)
    sim = Simulator("paper")
    for _ in range(50):
        sim.step()
    wanted = Renderer(320, 200).draw(sim).astype(int)
    with Image.open(out) as image:
        image.seek(5)
        shown = np.asarray(image.convert("RGB")).astype(int)
    # A GIF has 256 colours: mean deviation 1.35 grey levels; for a frame 10 ms earlier 2.97.
    assert np.abs(shown - wanted).mean() < 2.0


def test_the_same_command_gives_the_same_film_and_another_seed_another(tmp_path):
    films = []
    for name, seed in (("a", 1), ("b", 1), ("c", 2)):
        out = tmp_path / f"{name}.gif"
        film("--steps", 1, "--fps", 5, "--perturb", 0.01, "--seed", seed, "--out", out)
        films.append(out.read_bytes())
    assert films[0] == films[1] != films[2]


def test_a_fall_ends_the_film_and_is_named(tmp_path):
    out = tmp_path / "fall.gif"
    result = film("--scene", "push_only", "--steps", 50, "--fps", 5, "--out", out)
    assert "ended by fall" in result.stdout
    sim = Simulator("push_only")
    while sim.step():
        pass
    # The fall is that of the replay, in whole actions.
    assert len(gif(out)) == frames_until(sim.time, 5)


def test_invalid_films_are_refused_and_leave_no_file(tmp_path, monkeypatch):
    def refused(*arguments, words):
        result = run(*arguments)
        assert result.exit_code == 2, result.output
        for word in words:
            assert word in result.stderr, (word, result.stderr)
        assert "Traceback" not in result.stderr
        assert not any(tmp_path.iterdir())

    mp4, image = tmp_path / "film.mp4", tmp_path / "film.gif"
    refused("--out", tmp_path / "film.avi", words=["film.avi", ".mp4 or .gif"])
    refused("--out", tmp_path / "film", words=[".mp4 or .gif"])
    refused("--out", tmp_path / "none" / "film.mp4", words=["there is no folder", "none"])
    refused("--out", mp4, "--size", "321x200", words=["321x200", "even"])
    refused("--out", mp4, "--size", "10x10", words=["width is 10", "320"])
    refused("--out", mp4, "--size", "wide", words=["--size wide", "960x540"])
    refused("--out", image, "--fps", 100, words=["100 pictures", "at most 50"])
    refused("--out", mp4, "--scene", "nowhere", words=["nowhere", "paper"])
    monkeypatch.setitem(sys.modules, "imageio_ffmpeg", None)
    refused("--out", mp4, words=["imageio-ffmpeg", 'pip install "skate-env[render]"'])
    # A GIF does not need it.
    assert film("--steps", 1, "--fps", 2, "--out", image).exit_code == 0
