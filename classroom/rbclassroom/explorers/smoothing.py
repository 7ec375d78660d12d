"""The explorer of curves near a noisy recording."""

import warnings
from functools import lru_cache
from typing import Any

import numpy as np

import rbcourse as rb
from rbclassroom.explorers import widgets
from rbclassroom.explorers.explorer import Explorer, new_figure, new_line, numbers
from rbclassroom.figures.lesson16 import distance, hand
from rbcourse.draw.save import COLOURS, PALE
from rbcourse.draw.spheres import draw_sphere

TIMES, SEED = np.linspace(0, 4, 201), 16
PERIODS = np.round(np.geomspace(0.06, 3, 61), 3)
"""The periods of the slider, in s."""
_FASTEST, _LEAST, _MOST = 6.0, 0.05, 50.0
_BETWEEN = np.linspace(0, 4, 401)


@lru_cache(maxsize=64)
def recorded(noise: float) -> rb.Array:
    """Return rotations that were measured at the `TIMES`; the noise is an RMS in degrees."""
    sigma = np.radians(noise) / 3**0.5
    errors = np.random.default_rng(SEED).normal(scale=sigma, size=(len(TIMES), 3))
    return hand()(TIMES) @ rb.exp_so3(errors)


@lru_cache(maxsize=512)
def smoothed(noise: float, period: float | None) -> tuple[Any, float]:
    """Return a curve near the recording, and the estimated error of a prediction, in degrees."""
    R = recorded(noise)
    with warnings.catch_warnings(action="ignore"):
        c = rb.smoothing_spline(TIMES, R, period=period)
    misfit = np.sum((c(TIMES) - R) ** 2) / 2
    share = misfit / (3 * c.noise**2) / len(TIMES)
    return c, distance(c(TIMES), R) / share


def smoothing_explorer() -> Explorer:
    """Return an explorer of curves near noisy rotations, with their speeds and cross validation.

    On the sphere of directions, dots are the measured first axes of the body, and a line is the
    path of this axis along the smoothed curve. The upper right picture has the angular speeds of
    the true motion and of the curve. Below, a dot on the line of cross validation is the error of
    the prediction of an omitted pose, and a circle is the distance from the true motion
    (beyond BK 17).
    """
    truth = hand()
    with new_figure() as fig:
        ax: Any = fig.add_axes((0.0, 0.06, 0.5, 0.9), projection="space")
        draw_sphere(ax)
        ax.view_init(elev=5, azim=100)
        speeds, errors = fig.add_axes((0.57, 0.6, 0.4, 0.3)), fig.add_axes((0.57, 0.13, 0.4, 0.3))
        speeds.set(xlim=(0, 4), ylim=(0, _FASTEST), title="rad/s over time (s)")
        speeds.set(xticks=[0, 1, 2, 3, 4], yticks=[0, 2, 4, 6])
        speeds.plot(_BETWEEN, np.linalg.norm(truth(_BETWEEN, 1), axis=1), color=PALE, lw=5)
        errors.set(xscale="log", yscale="log", xlim=PERIODS[[0, -1]], ylim=(_LEAST, _MOST))
        errors.set(title="distance (°) over period (s)")
        errors.set_xticks([0.1, 1], ["0.1", "1"])
        errors.set_yticks([0.1, 1, 10], ["0.1", "1", "10"])
        errors.minorticks_off()
        colour: Any = {"color": COLOURS["projection"]}
        errors.text(0.03, 0.86, "omitted pose", transform=errors.transAxes, **colour)
        errors.text(0.03, 0.06, "true motion", transform=errors.transAxes)
        dot: Any = {"marker": "o", "ls": "", "clip_on": False}
        artists: dict[str, Any] = {
            "measured": new_line(ax, color=COLOURS["z"], marker="o", ls="", ms=2),
            "curve": new_line(ax, **colour, lw=2.5),
            "speed": new_line(speeds, **colour, lw=1.5),
            "omitted pose": new_line(errors, **colour, lw=2),
            "from the hand": new_line(errors, color="black", lw=1.5, ls="--"),
            "omitted pose now": new_line(errors, **colour, **dot),
            "from the hand now": new_line(errors, color="black", **dot),
        }
    controls = {
        "noise": widgets.slider("noise, RMS (°)", 1.0, 0.2, 5.0, 0.2),
        "period": widgets.listed("period (s)", 0.06, PERIODS.tolist(), 3),
    }

    @lru_cache(maxsize=64)
    def compared(noise: float) -> tuple[rb.Array, rb.Array]:
        both = [smoothed(noise, period) for period in PERIODS.tolist()]
        right = truth(TIMES)
        distances = [distance(c(TIMES), right) for c, _ in both]
        return np.array([x for _, x in both]), np.array(distances)

    def show(noise: float, period: float) -> dict[str, str]:
        c, predicted = smoothed(noise, period)
        best, _ = smoothed(noise, None)
        artists["measured"].set_data_3d(*recorded(noise)[:, :, 0].T)
        artists["curve"].set_data_3d(*c(_BETWEEN)[:, :, 0].T)
        artists["speed"].set_data(_BETWEEN, np.linalg.norm(c(_BETWEEN, 1), axis=1))
        predictions, distances = compared(noise)
        artists["omitted pose"].set_data(PERIODS, predictions)
        artists["from the hand"].set_data(PERIODS, distances)
        far = distance(c(TIMES), truth(TIMES))
        artists["omitted pose now"].set_data([period], [predicted])
        artists["from the hand now"].set_data([period], [far])
        return {
            "from an omitted pose": f"{numbers(predicted, 2)}°",
            "from the true motion": f"{numbers(far, 2)}°",
            "chosen by cross validation": f"{numbers(best.period, 2)} s",
        }

    return Explorer("Near a noisy recording", fig, artists, controls, show, plays="period")
