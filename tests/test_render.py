"""Pictures of the robot: properties of all pictures, the window, and rendering environments."""

import subprocess
import sys

import gymnasium
import imageio_ffmpeg
import numpy as np
import pytest
from gymnasium.error import DependencyNotInstalled, ResetNeeded
from gymnasium.wrappers import RecordVideo

import skate_env
from skate_env.environments import IceSkateEnv
from skate_env.render import Renderer, Window
from skate_env.render.figure import FREE, SUPPORT
from skate_env.render.overlay import PULL, PUSH
from skate_env.studies.fixtures import BLADE

# Rows of the default picture between the upper read-outs and the lower numbers and legend.
MIDDLE = slice(80, 460)
NUMBERS = slice(466, 488)


@pytest.fixture(scope="module")
def renderer():
    return Renderer()


def at(scene, time):
    sim = skate_env.Simulator(scene)
    if time:
        sim.advance(time)
    return sim


def rgb(text):
    return np.array([int(text[i : i + 2], 16) for i in (1, 3, 5)])


def has(picture, colour):
    """Count the pixels of a colour; edges are blended, interiors are not."""
    return int(np.all(picture == rgb(colour), axis=-1).sum())


def hue(picture, colour):
    """Columns of pixels with the hue of a colour, whatever its brightness or saturation."""
    grey, saturated = picture.min(axis=-1, keepdims=True), np.ptp(picture.astype(int), axis=-1)
    pure = (picture - grey) / np.maximum(saturated, 1)[..., None]
    wanted = (rgb(colour) - rgb(colour).min()) / np.ptp(rgb(colour))
    return np.nonzero((np.abs(pure - wanted).max(axis=-1) < 0.1) & (saturated > 60))[1]


@pytest.mark.parametrize("scene", skate_env.scene_names())
def test_every_preset_has_a_picture_and_drawing_changes_nothing(renderer, scene):
    sim = at(scene, 0.3)
    before = sim.snapshot()
    picture = renderer.draw(sim)
    assert picture.shape == (540, 960, 3) and picture.dtype == np.uint8
    assert sim.snapshot() == before
    assert np.ptp(picture[MIDDLE]) > 200


def test_equal_states_give_equal_pictures_in_fresh_arrays(renderer):
    first = renderer.draw(at("paper_printed", 0.5))
    kept = first.copy()
    renderer.draw(at(BLADE, 1.0))
    second = renderer.draw(at("paper_printed", 0.5))
    np.testing.assert_array_equal(first, second)
    np.testing.assert_array_equal(Renderer().draw(at("paper_printed", 0.5)), second)
    assert not np.shares_memory(first, second)
    second[:] = 0
    np.testing.assert_array_equal(first, kept)
    assert first.flags.writeable


def moved(metres):
    sim = skate_env.Simulator("paper_printed")
    q = sim.q
    q[0] += metres
    sim.reset(q, sim.v, sim.support_leg)
    return sim


def test_only_the_ruler_depends_on_the_distance(renderer):
    here, there = (renderer.draw(moved(metres)).astype(int) for metres in (0.0, 7.0))
    differs = np.abs(here - there).max(axis=(1, 2))
    # Sums of other numbers are rounded differently: measured 0, one grey level is acceptable.
    assert differs[: NUMBERS.start].max() <= 1 and differs[NUMBERS.stop :].max() <= 1
    assert differs[NUMBERS].max() > 100


def test_only_lines_on_the_ice_show_the_position_between_two_metres(renderer):
    here, there = (renderer.draw(moved(metres)).astype(int) for metres in (0.0, 0.37))
    differs = np.abs(here - there).max(axis=(1, 2))
    ice = 335
    assert differs[:ice].max() <= 1
    assert differs[ice:].max() > 30


def test_supporting_leg_is_orange_and_the_free_one_blue_whichever_leg_it_is(renderer):
    sim = skate_env.Simulator("paper_printed")
    q, v = sim.q, sim.v
    pictures = []
    for leg in ("right", "left"):
        sim.reset(q, v, leg)
        pictures.append(renderer.draw(sim)[MIDDLE])
    for picture in pictures:
        # In this posture the free foot is far behind.
        support, free = hue(picture, SUPPORT), hue(picture, FREE)
        assert support.size > 500 and free.size > 500
        assert np.quantile(free, 0.05) < np.quantile(support, 0.05) - 30
    # The near leg is drawn differently from the far leg.
    assert np.abs(pictures[0].astype(int) - pictures[1]).max() > 60


def test_arrows_appear_only_where_there_is_force(renderer):
    flying = at("push_only", 0.4)
    assert flying.state_number == 0
    # Measured: 4e-15 N, due to rounding.
    assert np.abs(flying.contact_forces).max() < 1e-12
    picture = renderer.draw(flying)[MIDDLE]
    assert has(picture, PUSH) == has(picture, PULL) == 0
    pushed = at(BLADE, 1.0)
    assert (pushed.contact_forces[:, 2:] >= 0).all() and pushed.contact_forces.any()
    picture = renderer.draw(pushed)[MIDDLE]
    assert has(picture, PUSH) > 20 and has(picture, PULL) == 0
    pulled = at("paper_printed", 1.05)
    assert (pulled.contact_forces[1, 2:] < 0).all()
    picture = renderer.draw(pulled)[MIDDLE]
    assert has(picture, PUSH) > 100 and has(picture, PULL) > 100


def test_a_scene_without_lifting_has_no_target(renderer):
    scene = skate_env.load_scene("paper_printed")
    sim = skate_env.Simulator(scene.without("lifting"))
    target = slice(0, 80), slice(400, 700)
    assert has(renderer.draw(skate_env.Simulator(scene))[target], "#F0E442") > 20
    assert has(renderer.draw(sim)[target], "#F0E442") == 0


def test_the_termination_is_shown(renderer):
    sim = at("push_only", 20.0)
    assert sim.termination == "fall"
    assert has(renderer.draw(sim)[84:114, 400:560], "#1E2A38") > 1000


@pytest.mark.parametrize("size", [(320, 200), (640, 480), (1001, 333), (320, 900)])
def test_any_size_is_drawn(size):
    width, height = size
    assert Renderer(width, height).draw(at("paper_printed", 1.05)).shape == (height, width, 3)


def test_robots_outside_the_picture_leave_the_ice(renderer):
    sim = skate_env.Simulator("push_only")
    q = sim.q
    q[1] += 500.0
    sim.reset(q, sim.v, sim.support_leg)
    assert renderer.draw(sim).shape == (540, 960, 3)


def test_invalid_sizes_are_refused_by_name(refused):
    refused(ValueError, lambda: Renderer(width=10), "width is 10", "320")
    refused(ValueError, lambda: Renderer(height=10**6), "height is 1000000", "4096")
    refused(TypeError, lambda: Renderer(width=640.5), "width is 640.5", "whole number")


def test_pictures_need_no_window_no_torch_and_no_film():
    code = """
import sys
for name in ("pygame", "torch", "OpenGL", "imageio", "imageio_ffmpeg", "moviepy"):
    sys.modules[name] = None
import gymnasium, skate_env
from skate_env.studies.fixtures import BLADE
env = gymnasium.make("IceSkate-v0", render_mode="rgb_array")
env.reset(seed=0)
env.step(env.action_space.sample())
assert env.render().shape == (540, 960, 3)
env.close()
try:
    gymnasium.make("IceSkate-v0", render_mode="human")
except gymnasium.error.DependencyNotInstalled as error:
    print(error)
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert 'pip install "skate-env[render]"' in done.stdout


# --- environments --------------------------------------------------------------------------------


def test_rgb_array_draws_the_simulator_behind_the_environment(renderer):
    env = IceSkateEnv("paper_printed", render_mode="rgb_array")
    assert env.metadata["render_fps"] == 100 and env.render_mode == "rgb_array"
    env.reset()
    zero = np.zeros(env.action_space.shape, np.float32)
    for _ in range(10):
        env.step(zero)
    sim = skate_env.Simulator("paper_printed")
    for _ in range(10):
        sim.step()
    np.testing.assert_array_equal(env.render(), renderer.draw(sim))


def test_render_follows_gymnasiums_rules():
    env = IceSkateEnv(render_mode="rgb_array")
    with pytest.raises(ResetNeeded, match="reset"):
        env.render()
    env = IceSkateEnv()
    env.reset()
    with pytest.warns(UserWarning, match="rgb_array"):
        assert env.render() is None
    with pytest.raises(ValueError, match=r"'ansi'.*human, rgb_array"):
        IceSkateEnv(render_mode="ansi")


def test_record_video_writes_every_picture(tmp_path):
    env = RecordVideo(gymnasium.make("IceSkate-v0", render_mode="rgb_array"), str(tmp_path / "new"))
    env.reset(seed=0)
    for _ in range(19):
        env.step(np.zeros(env.action_space.shape, np.float32))
    env.close()
    (film,) = (tmp_path / "new").glob("*.mp4")
    frames, seconds = imageio_ffmpeg.count_frames_and_secs(str(film))
    # The start, and one frame per action of 20 ms.
    assert frames == 20
    assert seconds == pytest.approx(0.4, abs=0.011)


# --- the window ----------------------------------------------------------------------------------


@pytest.fixture
def dummy():
    """Return pygame with invisible windows (see `conftest.py`)."""
    import pygame

    yield pygame
    pygame.quit()


def test_human_mode_shows_reset_and_steps_at_the_motions_pace(dummy, monkeypatch):
    shown = []
    monkeypatch.setattr(Window, "show", lambda window, frame: shown.append(frame))
    env = IceSkateEnv("paper_printed", render_mode="human")
    env.reset()
    assert len(shown) == 1
    for _ in range(4):
        env.step(np.zeros(env.action_space.shape, np.float32))
    # Every second action of 10 ms: 50 frames per second.
    assert len(shown) == 3
    assert env.render() is None and len(shown) == 3
    assert not np.array_equal(shown[1], shown[2])


def test_the_window_shows_the_picture_and_can_be_closed(dummy, renderer):
    window = Window(0.001)
    frame = renderer.draw(at("paper_printed", 0.5))
    window.show(frame)
    surface = dummy.display.get_surface()
    np.testing.assert_array_equal(dummy.surfarray.array3d(surface).swapaxes(0, 1), frame)
    assert not window.closed
    dummy.event.post(dummy.event.Event(dummy.QUIT))
    window.show(frame)
    assert window.closed and dummy.display.get_surface() is None
    # Rendering without the window does not fail.
    window.show(frame)
    window.close()
    assert dummy.display.get_surface() is None


def test_closing_the_environment_closes_its_window(dummy):
    env = IceSkateEnv("paper_printed", render_mode="human")
    env.reset()
    assert dummy.display.get_surface() is not None
    env.close()
    env.close()
    assert dummy.display.get_surface() is None


def test_missing_pygame_is_named(monkeypatch):
    monkeypatch.setitem(sys.modules, "pygame", None)
    with pytest.raises(DependencyNotInstalled, match=r'pip install "skate-env\[render\]"'):
        Window(0.01)
