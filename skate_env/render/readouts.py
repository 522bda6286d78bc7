"""Readouts in the corners: contact state, time, speed and a legend."""

import numpy as np
from PIL import Image, ImageDraw, ImageFont

from .._core import Simulator
from .figure import FREE, SUPPORT
from .overlay import INK, PAPER, PER_NEWTON, PULL, PUSH, Fill, Font, arrow, label, mark, smooth
from .view import View

_FAINT = "#43536A"
_LEGEND_FORCE = 500.0
# Colour with opacity and corner radius of a card.
_CARD, _CORNER = (255, 255, 255, 200), 10.0
# Distance from the picture's edge; height of the cards, width of the time's.
_MARGIN, _TALL, _TIME_WIDE = 14.0, 56.0, 150.0


class Readouts:
    """Readouts for pictures of one size; lengths in px of a picture of 900 x 540."""

    def __init__(self, view: View) -> None:
        self._unit = u = max(min(view.width / 900, view.height / 540), 0.5)
        self._tiny, self.small, self._plain, self._large = (
            ImageFont.load_default(size * u) for size in (10.0, 13.0, 16.0, 26.0)
        )
        self._view = view
        # Positions of the legs' coloured squares, and width of the card.
        self._squares = 68.0, 68.0 + 31.0 + self.small.getlength("right leg supports") / u
        wide = self._squares[1] + 29.0 + self.small.getlength("right leg free") / u
        self._state, self._time = self._card(wide), self._card(_TIME_WIDE)
        _round(self._state, (0.0, 0.0, _TALL, _TALL), _CORNER * u, INK, u)
        for x, colour in zip(self._squares, (SUPPORT, FREE), strict=True):
            _round(self._state, (x, 34.0, x + 10.0, 44.0), 3.0 * u, colour, u)
        draw = ImageDraw.Draw(self._time)
        for row, unit in ((20.0, "s"), (43.0, "m/s")):
            draw.text((108.0 * u, row * u), unit, _FAINT, self.small, "lm")
        self._legend = self._draw_legend()

    def draw(self, image: Image.Image, sim: Simulator, name: str, speed: float) -> None:
        """Write a simulator's state, its scene's name and a speed [m/s]."""
        u, margin = self._unit, round(_MARGIN * self._unit)
        right = self._view.width - margin - self._time.width
        for card, place in (
            (self._state, (margin, margin)),
            (self._time, (right, margin)),
            (self._legend, (margin, self._view.height - margin // 2 - self._legend.height)),
        ):
            image.paste(card, place, card)
        draw = ImageDraw.Draw(image)

        def write(x: float, y: float, text: str, font: Font, colour: str, anchor: str) -> None:
            draw.text((margin + x * u, margin + y * u), text, colour, font, anchor)

        write(28, 15, "state", self._tiny, PAPER, "mm")
        write(28, 34, str(sim.state_number), self._large, PAPER, "mm")
        write(68, 18, sim.state_name.replace("/", " / "), self._plain, INK, "lm")
        other = "left" if sim.support_leg == "right" else "right"
        legs = f"{sim.support_leg} leg supports", f"{other} leg free"
        for x, text in zip(self._squares, legs, strict=True):
            write(x + 15, 39, text, self.small, _FAINT, "lm")
        edge = (right - margin) / u + 102
        write(edge, 20, f"{sim.time:.2f}", self._large, INK, "rm")
        write(edge, 43, f"{speed:.2f}", self._plain, INK, "rm")
        corner = np.array([self._view.width - margin, self._view.height - 18 * u])
        label(image, corner, name, self.small, INK, "rm")
        if sim.termination is not None:
            self._end(draw, sim.termination)

    def _end(self, draw: ImageDraw.ImageDraw, cause: str) -> None:
        u, middle = self._unit, self._view.width / 2
        text = f"ended: {cause}"
        half = draw.textlength(text, self._plain) / 2 + 14 * u
        draw.rounded_rectangle((middle - half, 84 * u, middle + half, 114 * u), 15 * u, INK)
        draw.text((middle, 99 * u), text, PAPER, self._plain, "mm")

    def _card(self, wide: float) -> Image.Image:
        u = self._unit
        card = Image.new("RGBA", (round(wide * u), round(_TALL * u)), (255, 255, 255, 0))
        _round(card, (0.0, 0.0, wide, _TALL), _CORNER * u, _CARD, u)
        return card

    def _draw_legend(self) -> Image.Image:
        """Draw the legend on a transparent background."""
        u, view = self._unit, self._view
        strip = Image.new("RGBA", (view.width, round(34 * u)), (255, 255, 255, 0))
        middle = 16.0 * u
        x = _MARGIN * u
        long = _LEGEND_FORCE * PER_NEWTON * view.scale
        for colour, text in ((PUSH, f"{_LEGEND_FORCE:.0f} N push"), (PULL, "pull")):
            arrow(strip, np.array([x, middle]), np.array([x + long, middle]), view.scale, colour)
            x += long + 7 * u
            x = self._write(strip, x, middle, text) + 18 * u
        mark(strip, np.array([x + 8 * u, middle]), 120 * u)
        self._write(strip, x + 22 * u, middle, "head target")
        return strip.crop(strip.getbbox())

    def _write(self, strip: Image.Image, x: float, y: float, text: str) -> float:
        label(strip, np.array([x, y]), text, self.small, INK, "lm")
        return x + self.small.getlength(text)


def _round(
    image: Image.Image,
    box: tuple[float, float, float, float],
    radius: float,
    fill: Fill,
    unit: float,
) -> None:
    left, top, right, bottom = (unit * edge for edge in box)
    with smooth(image, [(left, top), (right, bottom)], 0.0) as pen:
        if pen:
            pen.rounded((left, top, right - 1 / 4, bottom - 1 / 4), radius, fill)
