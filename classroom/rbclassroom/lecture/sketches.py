"""The computed curves of the sketches that stand beside the slides.

Run ``python -m rbclassroom.lecture.sketches`` in the folder of the course. It writes the paths
that the functions of this module return into ``notebooks/slides/06.svg`` and the other files. A
function returns the paths of one sketch by the ids of their elements. Everything else in a sketch
is drawn by hand.
"""

import math
import re
from collections.abc import Callable
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

import rbcourse as rb
from rbclassroom.explorers.paths import POSES
from rbcourse.files import replace_file
from rbcourse.straight_line import theta

FOLDER = Path("notebooks", "slides")
STEP = 0.1
"""The unit of the last digit of a stored coordinate; a sketch beside a text is 640 units wide."""
_NUMBER = re.compile(r"-?\d+(?:\.\d)?")
Points = NDArray[Any]
Paths = dict[str, str]


def smooth(t: Points, points: Points, rates: Points) -> str:
    """Return a path of cubics through points (N, 2) with the given derivatives at the times t."""
    third = np.diff(t)[:, None] / 3
    pieces = np.hstack(
        [points[:-1] + third * rates[:-1], points[1:] - third * rates[1:], points[1:]]
    )
    return f"M{_written(points[0])} C{_written(pieces)}"


def through(points: Points, closed: bool = False) -> str:
    """Return a smooth path through points (N, 2), with the derivatives of a spline."""
    number = np.arange(len(points))
    spline = CubicSpline(number, points, bc_type="periodic" if closed else "not-a-knot")
    return smooth(number, points, spline(number, 1))


def graph(axes: tuple[float, ...], x: Points, y: Points, slope: Points) -> str:
    """Return a smooth graph; `axes` are the place of (0, 0) and the units of x and y."""
    left, zero, width, height = axes
    points = np.stack([left + width * x, zero - height * y], axis=1)
    rates = np.stack(np.broadcast_arrays(float(width), -height * slope), axis=1)
    return smooth(x, points, rates)


def straight(points: Points) -> str:
    """Return a path of segments through points (N, 2)."""
    return f"M{_written(points[0])} L{_written(points[1:])}"


def _written(numbers: Points) -> str:
    rounded = np.round(np.ravel(numbers), 1) + 0.0  # no "-0"
    return " ".join(f"{number:.1f}".removesuffix(".0") for number in rounded)


def counts() -> Paths:
    """Return the probabilities of k heads in 100 throws; tails begin at 35 and 65 heads."""
    heads = np.arange(33, 68)
    share = np.array([math.comb(100, k) for k in heads]) / math.comb(100, 50)
    x = 325 + 12.5 * (heads - 50)
    bars = [
        straight(np.array([[x, 580], [x, y]])) for x, y in zip(x, 580 - 400 * share, strict=True)
    ]
    return {"counts-tails": " ".join(bars[:3] + bars[-3:]), "counts-middle": " ".join(bars[3:-3])}


def speeds() -> Paths:
    """Return the derivative of θ, for turns by 30°, 90° and 150°."""
    t, axes = np.linspace(0, 1, 17), (60, 600, 480, 170)
    rates = {a: [theta(t, np.radians(a), order) for order in (1, 2)] for a in (30, 90, 150)}
    return {f"speeds-{a}": graph(axes, t, *rate) for a, rate in rates.items()}


def energy() -> Paths:
    """Return the energy of the projected line, divided by that of the geodesic, up to 160°."""
    x, weights = np.polynomial.legendre.leggauss(100)
    degrees = np.linspace(1, 160, 17)
    rates = [theta((1 + x) / 2, np.radians(a), 1) for a in degrees]
    ratio = np.square(rates) @ weights / 2
    return {"energy-ratio": through(np.stack([60 + degrees / 0.36, 600 - 210 * ratio], axis=1))}


def saddle() -> Paths:
    """Return the curves of constant energy on the sphere of J ω, for a book of 20 × 13 × 3 cm.

    With unit J ω, the energy is a mean of the reciprocal moments, so that of axis 2 is a saddle.
    """
    square = np.square([20, 13, 3])
    inverse = 1 / (square.sum() - square)
    shares = np.array([0.25, 0.55, 0.9])
    levels = [inverse[1] + share * (inverse[k] - inverse[1]) for k in (0, 2) for share in shares]
    found = {"levels": levels, "crossing": [inverse[1]]}
    return {f"saddle-{name}": " ".join(_seen(inverse, each)) for name, each in found.items()}


def _seen(inverse: Points, levels: list[float]) -> list[str]:
    """Return the visible parts of the curves of some levels."""
    (c, s), (cos, sin) = ((np.cos(a), np.sin(a)) for a in np.radians([22, 30]))
    view = np.array([[c, -s, 0], [s * sin, c * sin, -cos], [s * cos, c * cos, sin]])
    turn, parts = np.linspace(0, 2 * np.pi, 721), []
    for level, sign in product(levels, (1, -1)):
        k = 0 if level >= inverse[1] else 2  # the axis that the curve surrounds
        size = np.sqrt((inverse[k] - level) / (inverse[k] - np.delete(inverse, k)))
        b, c = size[:, None] * [np.cos(turn), np.sin(turn)]
        a = sign * np.sqrt(np.maximum(1 - b**2 - c**2, 0))
        if level == inverse[1]:  # two circles, which cross at axis 2
            a = np.copysign(a, sign * np.sin(turn))
        x, y, depth = view @ np.insert([b, c], k, a, axis=0)
        points = np.stack([224 + 218 * x, 352 + 218 * y], axis=1)
        if depth.min() > 0:
            parts.append(through(points[::72], closed=True))
        elif depth.max() > 0:
            first = depth.argmin()
            there = np.roll(points[:-1], -first, axis=0)[np.roll(depth[:-1], -first) > 0]
            parts.append(through(there[np.linspace(0, len(there) - 1, 10).astype(int)]))
    return parts


def start() -> Paths:
    """Return the angular velocity of a turn by 90° from rest to rest, up to its middle."""
    R0, R1, rest = np.eye(3), rb.exp_so3([0, 0, np.pi / 2]), np.zeros(3)
    t, axes = np.linspace(0, 0.5, 6), (60, 600, 1080, 137.6)
    found = {
        "projection": rb.projected_cubic(R0, R1, rest, rest),
        "optimum": rb.minimum_acceleration(R0, R1, rest, rest),
    }
    return {
        f"start-{name}": graph(axes, t, curve(t, 1)[:, 2], curve(t, 2)[:, 2])
        for name, curve in found.items()
    }


def angles() -> Paths:
    """Return the angle of a turn by 150° from rest to rest, by two closed forms."""
    R0, R1, rest = np.eye(3), rb.exp_so3([0, 0, np.radians(150)]), np.zeros(3)
    t, axes = np.linspace(0, 1, 9), (70, 600, 510, 154)
    found = {
        "cayley": rb.closed_forms.cayley_cubic(R0, R1, rest, rest),
        "exponential": rb.closed_forms.exponential_cubic(R0, R1, rest, rest),
    }
    return {
        f"angles-{name}": graph(axes, t, rb.angle_between(R0, curve(t)), curve(t, 1)[:, 2])
        for name, curve in found.items()
    }


def triangle() -> Paths:
    """Return the natural cubic spline through three angles."""
    t = np.array([0, 1, 1 + np.sqrt(2)])
    spline = CubicSpline(t, [0, 1, 0.3], bc_type="natural")
    return {"triangle-angle": graph((80, 300, 212, 180), t, spline(t), spline(t, 1))}


def onerate() -> Paths:
    """Return the acceleration of the centre on the path of lesson 15, at one rate."""
    path = rb.projected_spline(np.arange(4.0), POSES)
    s = np.linspace(0, 3, 121)
    size = np.linalg.norm(path(s, 2)[:, 3:], axis=1)
    points = np.stack([70 + 178 * s, 570 - 370 * size / size.max()], axis=1)
    return {"onerate-acceleration": straight(points)}


SKETCHES: dict[str, tuple[Callable[[], Paths], ...]] = {
    "05": (counts,),
    "06": (speeds, energy),
    "08": (saddle,),
    "09": (start,),
    "11": (angles,),
    "14": (triangle,),
    "15": (onerate,),
}
"""The functions of each file."""


def agree(one: str, other: str) -> bool:
    """Tell whether two paths are equal up to a step of the last digit, as processors round."""
    if _NUMBER.sub("", one) != _NUMBER.sub("", other):
        return False
    numbers = [np.array(_NUMBER.findall(path), float) for path in (one, other)]
    return bool(np.abs(numbers[0] - numbers[1]).max(initial=0) < 1.5 * STEP)


def updated(text: str, paths: Paths) -> str:
    """Return the text of a file of sketches with computed paths in place of others."""
    for name, path in paths.items():
        place = re.search(rf'(?<=<path id="{name}" d=")[^"]*', text)
        if not place:
            raise ValueError(f'there is no <path id="{name}" d="">')
        if not agree(place[0], path):
            text = text[: place.start()] + path + text[place.end() :]
    return text


def main() -> None:
    """Write the computed paths into the sketches."""
    for number, sketches in SKETCHES.items():
        file = FOLDER / f"{number}.svg"
        text = file.read_text(encoding="utf-8")
        paths = {name: path for sketch in sketches for name, path in sketch().items()}
        if (now := updated(text, paths)) != text:
            replace_file(file, now.encode())
            print(f"{file} is written")


if __name__ == "__main__":
    main()
