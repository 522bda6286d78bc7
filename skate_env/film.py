"""Films of a scene's motion, as MP4 or GIF files."""

import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from gymnasium.error import DependencyNotInstalled
from numpy.typing import NDArray
from PIL import Image
from tqdm import tqdm

from ._core import Simulator
from .recording import LONGEST_STEP
from .render import Renderer

SUFFIXES = (".mp4", ".gif")
# GIF files count time in hundredths of a second, and viewers slow down what is faster than this.
_GIF_TICK, _GIF_FASTEST = 0.01, 50.0
# Moments that are nearer to each other than this are the same [s].
_SAME = 1e-9
# Every so many pictures one gives its colours to the palette of a GIF.
_PALETTE_PICTURES = 12

Frame = NDArray[np.uint8]


@dataclass(frozen=True)
class Film:
    """What was filmed: number of pictures, time that the film and the motion take [s]."""

    frames: int
    play_time: float
    motion_time: float
    steps: int
    end_cause: str | None


def check(path: Path, renderer: Renderer, fps: float) -> None:
    """Refuse a film that cannot be written, before time is spent on it.

    Raises
    ------
    ValueError
        For an unknown suffix, or a rate or a size that the format cannot have.
    FileNotFoundError
        If the folder does not exist.
    gymnasium.error.DependencyNotInstalled
        If imageio-ffmpeg is missing, for MP4.
    """
    if path.suffix.lower() not in SUFFIXES:
        raise ValueError(f"{path}: the name must end in {' or '.join(SUFFIXES)}")
    if not path.parent.is_dir():
        raise FileNotFoundError(f"{path}: there is no folder {path.parent}")
    if path.suffix.lower() == ".gif":
        if fps > _GIF_FASTEST:
            raise ValueError(f"{fps:g} pictures a second: a GIF has at most {_GIF_FASTEST:g}")
        return
    if renderer.width % 2 or renderer.height % 2:
        size = f"{renderer.width}x{renderer.height}"
        raise ValueError(f"size {size}: width and height of an MP4 must be even")
    try:
        import imageio_ffmpeg  # noqa: F401
    except ImportError:
        raise DependencyNotInstalled(
            'MP4 needs imageio-ffmpeg: pip install "skate-env[render]"; GIF does without'
        ) from None


def make(
    path: Path, sim: Simulator, renderer: Renderer, steps: int, fps: float, slow: float
) -> Film:
    """Film a simulator from its present state on, with a progress bar on stderr.

    Parameters
    ----------
    path
        The file, see `check`; one that is there already is replaced.
    sim
        Is driven by its scene's controller alone.
    steps
        The film ends with the step of this number, or when the simulation does.
    fps
        Pictures per second of the film.
    slow
        How much slower than the motion the film is: 1 is real time.

    Raises
    ------
    ValueError, FileNotFoundError, gymnasium.error.DependencyNotInstalled
        As of `check`.
    """
    check(path, renderer, fps)
    begin, made, frames = sim.time, 0, 0
    sim.take_steps()
    between = Simulator(sim.scene)

    def pictures(progress: Callable[[], object]) -> Iterator[Frame]:
        nonlocal made, frames
        last, goes_on = begin, True
        while goes_on and made < steps and sim.time - last < LONGEST_STEP:
            moment = begin + frames / (fps * slow)
            # By whole actions, so that the film shows the replay.
            while goes_on and sim.time + sim.action_period < moment + _SAME:
                goes_on = sim.step()
                for step in sim.take_steps():
                    made += 1
                    last = step["time"]
                    progress()
            if goes_on and sim.time < moment - _SAME:
                between.restore(sim.snapshot())
                between.advance(moment)
                yield renderer.draw(between)
            else:
                yield renderer.draw(sim)
            frames += 1

    with tqdm(total=steps, desc=path.name, unit="step", file=sys.stderr) as bar:
        write = _write_gif if path.suffix.lower() == ".gif" else _write_mp4
        write(path, pictures(bar.update), renderer, fps)
    return Film(frames, frames / fps, sim.time - begin, made, sim.end_cause)


def _write_mp4(path: Path, frames: Iterator[Frame], renderer: Renderer, fps: float) -> None:
    import imageio_ffmpeg

    writer = imageio_ffmpeg.write_frames(
        str(path), (renderer.width, renderer.height), fps=fps, quality=8, macro_block_size=2
    )
    writer.send(None)
    try:
        for frame in frames:
            writer.send(frame)
    finally:
        writer.close()


def _write_gif(path: Path, frames: Iterator[Frame], renderer: Renderer, fps: float) -> None:
    images = [Image.fromarray(frame) for frame in frames]
    # One palette for all, so that what stands still has the same colour in every picture.
    chosen = images[::_PALETTE_PICTURES]
    strip = Image.new("RGB", (renderer.width, renderer.height * len(chosen)))
    for i, image in enumerate(chosen):
        strip.paste(image, (0, i * renderer.height))
    # One half has the shades that fill the picture, the other the colours of what is small in it.
    palette = Image.new("P", (1, 1))
    kinds = Image.Quantize.MEDIANCUT, Image.Quantize.MAXCOVERAGE
    palette.putpalette([part for kind in kinds for part in _palette(strip, kind)])
    flat = [image.quantize(palette=palette, dither=Image.Dither.NONE) for image in images]
    # Rounded so that errors do not add up.
    ends = np.rint(np.arange(len(flat) + 1) / (fps * _GIF_TICK)).astype(int)
    durations = [int(10 * ticks) for ticks in np.diff(ends)]
    flat[0].save(
        path, save_all=True, append_images=flat[1:], duration=durations, loop=0, optimize=False
    )


def _palette(image: Image.Image, kind: Image.Quantize) -> list[int]:
    """Choose 128 colours of an image (384 numbers: red, green, blue)."""
    chosen = image.quantize(128, kind).getpalette() or []
    return (chosen + [0] * 384)[:384]
