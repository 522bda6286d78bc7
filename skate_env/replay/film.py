"""Films of a scene's motion, as MP4 or GIF files."""

import itertools
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from gymnasium.error import DependencyNotInstalled
from numpy.typing import NDArray
from PIL import Image

from .._core import Simulator
from ..common import ProgressBar, between, count, progress_bar, replaced
from ..render import Renderer, SideBySide
from .film_rollout import FilmRollout
from .recorder import ResidualPolicy

SUFFIXES = (".mp4", ".gif")
# Ranges of the frame rate [1/s] and of the slow motion factor.
_RATES, _FACTORS = (1.0, 200.0), (0.01, 1000.0)
# Unit of a GIF's frame durations [s], and the highest rate that viewers play [1/s].
_GIF_TICK, _GIF_FASTEST = 0.01, 50.0
# Limit on its frames, all of which are in memory at once [bytes].
_GIF_MEMORY = 2**31
# Every n-th frame, counted from the last, contributes its colours to the palette of a GIF.
_PALETTE_PICTURES = 12

Frame = NDArray[np.uint8]
Sized = Renderer | SideBySide


@dataclass(frozen=True)
class Film:
    """Summary of a film: frames, duration of the film and of the motion [s], gait steps."""

    frames: int
    play_time: float
    motion_time: float
    steps: int
    termination: str | None


def check(path: str | Path, size: Sized, fps: float) -> None:
    """Check that a film can be written, before it is computed.

    Raises
    ------
    TypeError, ValueError
        For an unknown suffix, or a rate or a size that the format cannot have.
    FileNotFoundError
        If the folder does not exist.
    gymnasium.error.DependencyNotInstalled
        If imageio-ffmpeg is missing, for MP4.
    """
    path = Path(path)
    if path.suffix.lower() not in SUFFIXES:
        raise ValueError(f"{path}: the name must end in {' or '.join(SUFFIXES)}")
    if not path.parent.is_dir():
        raise FileNotFoundError(f"{path}: there is no folder {path.parent}")
    between("fps", fps, *_RATES)
    if path.suffix.lower() == ".gif":
        if fps > _GIF_FASTEST:
            raise ValueError(f"{fps:g} pictures per second: a GIF has at most {_GIF_FASTEST:g}")
        return
    if size.width % 2 or size.height % 2:
        given = f"{size.width}x{size.height}"
        raise ValueError(f"size {given}: width and height of an MP4 must be even")
    try:
        import imageio_ffmpeg  # noqa: F401
    except ImportError:
        raise DependencyNotInstalled(
            'MP4 needs imageio-ffmpeg: pip install "skate-env[render]"; GIF does without'
        ) from None


def make(
    path: str | Path,
    sim: Simulator,
    renderer: Renderer,
    steps: int,
    fps: float,
    slow: float,
    policy: ResidualPolicy | None = None,
) -> Film:
    """Film a simulation from its present state, with a progress bar on stderr.

    Parameters
    ----------
    path
        The file, see `check`; an existing file is replaced.
    sim
        Simulator with the scene's controller, and the policy if there is one.
    steps
        The film ends with the gait step of this number, or with the simulation.
    fps
        Pictures per second of the film.
    slow
        Slow motion factor; 1 is real time.
    policy
        Policy whose residual is constant over each action period.

    Raises
    ------
    TypeError, ValueError, FileNotFoundError, gymnasium.error.DependencyNotInstalled
        As in `check`; also if ``steps`` is not an int of at least 1, or ``slow`` out of range.
    """
    rollout = FilmRollout(sim, policy)
    (film,) = _film(path, [rollout], renderer, lambda sims: renderer.draw(*sims), steps, fps, slow)
    return film


def make_comparison(
    path: str | Path,
    sim: Simulator,
    stage: SideBySide,
    steps: int,
    fps: float,
    slow: float,
    policy: ResidualPolicy,
) -> tuple[Film, Film]:
    """Film the baseline and a policy side by side, both from a simulator's present state.

    The film ends when both have made their steps or have ended; the last frame of an ended one
    remains, in grey. Arguments and errors are those of `make`.

    Returns
    -------
    baseline, policy
        The summary of each.
    """
    copy = Simulator(sim.scene)
    copy.restore(sim.snapshot())
    rollouts = [FilmRollout(copy), FilmRollout(sim, policy)]
    baseline, learned = _film(path, rollouts, stage, stage.draw, steps, fps, slow)
    return baseline, learned


def _film(
    path: str | Path,
    rollouts: Sequence[FilmRollout],
    stage: Sized,
    draw: Callable[[Sequence[Simulator]], Frame],
    steps: int,
    fps: float,
    slow: float,
) -> list[Film]:
    """Film the rollouts; return the summary of each."""
    path = Path(path)
    check(path, stage, fps)
    between("slow", slow, *_FACTORS)
    steps = count("steps", steps)
    made = 0

    def pictures(bar: ProgressBar) -> Iterator[Frame]:
        nonlocal made
        done = False
        while not done:
            moment = made / (fps * slow)
            yield draw([rollout.advance(moment) for rollout in rollouts])
            made += 1
            bar.update(rollouts[-1].steps - bar.n)
            done = all(rollout.is_done(steps) for rollout in rollouts)

    with progress_bar(steps, path.name, "step") as bar, replaced(path) as part:
        if path.suffix.lower() == ".gif":
            _write_gif(part, pictures(bar), stage, fps)
        else:
            _write_mp4(part, pictures(bar), stage, fps)
            _check_mp4(part, made)
    return [Film(made, made / fps, x.motion_time, x.steps, x.termination) for x in rollouts]


def _write_mp4(path: Path, frames: Iterator[Frame], size: Sized, fps: float) -> None:
    import imageio_ffmpeg

    writer = imageio_ffmpeg.write_frames(
        str(path), (size.width, size.height), fps=fps, quality=8, macro_block_size=2
    )
    writer.send(None)
    try:
        for frame in frames:
            writer.send(frame)
    finally:
        writer.close()


def _check_mp4(path: Path, count: int) -> None:
    """Check that a film is complete, because the writer does not report failures of ffmpeg."""
    import imageio_ffmpeg

    try:
        found, _ = imageio_ffmpeg.count_frames_and_secs(str(path))
    except RuntimeError:
        found = 0
    if found != count:
        raise OSError(f"ffmpeg has not written the film: {found} of {count} frames are in the file")


def _write_gif(path: Path, frames: Iterator[Frame], size: Sized, fps: float) -> None:
    most = _GIF_MEMORY // (3 * size.width * size.height)
    images = [Image.fromarray(frame) for frame in itertools.islice(frames, most + 1)]
    if len(images) > most:
        raise ValueError(f"a GIF of this size has at most {most} frames; an MP4 has no limit")
    # One palette for all frames, so that a static object keeps its colour.
    chosen = images[::-_PALETTE_PICTURES]
    strip = Image.new("RGB", (size.width, size.height * len(chosen)))
    for i, image in enumerate(chosen):
        strip.paste(image, (0, i * size.height))
    # Half of the palette covers large areas, the other half small coloured objects.
    palette = Image.new("P", (1, 1))
    kinds = Image.Quantize.MEDIANCUT, Image.Quantize.MAXCOVERAGE
    palette.putpalette([part for kind in kinds for part in _palette(strip, kind)])
    flat = [image.quantize(palette=palette, dither=Image.Dither.NONE) for image in images]
    # Times of frames are rounded, so that rounding errors do not accumulate.
    ends = np.rint(np.arange(len(flat) + 1) / (fps * _GIF_TICK)).astype(int)
    durations = [int(10 * ticks) for ticks in np.diff(ends)]
    flat[0].save(
        path, save_all=True, append_images=flat[1:], duration=durations, loop=0, optimize=False
    )


def _palette(image: Image.Image, kind: Image.Quantize) -> list[int]:
    """Choose 128 colours of an image (384 numbers: red, green, blue)."""
    chosen = image.quantize(128, kind).getpalette() or []
    return (chosen + [0] * 384)[:384]
