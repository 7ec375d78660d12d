"""The explorer of the fastest timing of a path, in the phase plane."""

from functools import lru_cache
from typing import Any

import numpy as np

import rbcourse as rb
from rbclassroom.explorers import widgets
from rbclassroom.explorers.explorer import Explorer, new_figure, new_line, new_space, numbers
from rbclassroom.explorers.names import new_name, put_name
from rbclassroom.explorers.paths import EDGES, POSES
from rbclassroom.figures.lesson15 import highest_rates
from rbcourse.draw.bodies import draw_box, move_box
from rbcourse.draw.save import COLOURS, PALE

LIMITS = "angular_speed", "speed", "acceleration"
_HIGHEST = 2.0
_IN_USE = 0.995


def timing_explorer() -> Explorer:
    """Return an explorer of the fastest timing of a path within limits.

    The right picture is the phase plane: the rate of the path parameter s against s, with a pose at
    each integer s. No timing may lie above the limit curves. The grey line is the timing at a
    constant rate. The box moves with the fastest timing. The controls are the largest allowed
    ``angular_speed`` of the box, the largest ``speed`` and ``acceleration`` of its centre, and
    ``t``, the time as a fraction of the duration, which the play button moves (beyond BK 16).
    """
    path = rb.projected_spline(np.arange(4.0), POSES)
    with new_figure() as fig:
        space = new_space(fig, (-0.075, 0.03, 0.55, 0.89), 2.4)
        artists: dict[str, Any] = {
            "way": space.plot(*path(np.linspace(0, 3, 121))[:, :3, 3].T, color=COLOURS["path"])[0],
            "poses": space.plot(*POSES[:, :3, 3].T, "o", color=COLOURS["reference"])[0],
            "box": draw_box(space, POSES[0], EDGES),
        }
        ax = fig.add_axes((0.5, 0.18, 0.39, 0.71))
        ax.set(xlim=(0, 3), ylim=(0, _HIGHEST), xlabel="$s$", ylabel=r"rate $\dot s$")
        ax.set(xticks=[0, 1, 2, 3], yticks=[0, 0.5, 1, 1.5, 2])
        for knot in (1, 2):
            ax.axvline(knot, color=PALE, lw=1, ls=":")
        looks: dict[str, Any] = {
            "acceleration limit": {"color": COLOURS["x"], "lw": 1.5},
            "speed limits": {"color": COLOURS["z"], "lw": 1.5, "ls": "-."},
            "one rate": {"color": COLOURS["reference"], "lw": 1.5, "ls": "--"},
            "fastest": {"color": COLOURS["optimum"], "lw": 2.5},
        }
        artists |= {name: new_line(ax, **look) for name, look in looks.items()}
        artists["now"] = new_line(ax, color="black", marker="o", ls="", clip_on=False)
        ax.text(1.5, 1.04 * _HIGHEST, "acceleration limit", color=COLOURS["x"], ha="center")
        ax.text(0.13, 0.03, "fastest")
        artists["one rate name"] = new_name(ax, "one rate", color=COLOURS["reference"])
        beside = {"color": COLOURS["z"], "ha": "left"}
        artists["speed limits name"] = new_name(ax, "speed\nlimits", **beside)
    controls = {
        "angular_speed": widgets.slider("ω at most (rad/s)", 1.0, 0.5, 3.0, 0.1),
        "speed": widgets.slider("v at most (m/s)", 1.5, 0.5, 3.0, 0.1),
        "acceleration": widgets.slider("a at most (m/s²)", 2.0, 0.5, 6.0, 0.1),
        "t": widgets.stepped("time t", 0.3, 0.0, 1.0, 0.01),
    }

    @lru_cache(maxsize=16)
    def timed(*most: float) -> tuple[Any, float, dict[str, rb.Array]]:
        limits: dict[str, Any] = dict(zip(LIMITS, most, strict=True))
        used = rb.limits_used(path, **limits)
        even = max(x if name.endswith("speed") else x**0.5 for name, (x, _) in used.items())
        s = np.linspace(0, 3, 241)
        highest = highest_rates(path, s, limits)
        return rb.fastest(path, **limits), 1 / even, {"s": s, **highest}

    def show(angular_speed: float, speed: float, acceleration: float, t: float) -> dict[str, str]:
        most = angular_speed, speed, acceleration
        fastest, rate, highest = timed(*most)
        s, now = highest["s"], t * fastest.domain[1]
        artists["acceleration limit"].set_data(s, highest["accelerations"])
        artists["speed limits"].set_data(s, highest["speeds"])
        artists["one rate"].set_data([0, 3], [rate, rate])
        put_name(artists["one rate name"], [1.5, max(rate - 0.1, 0.08)])
        put_name(artists["speed limits name"], [3.08, min(highest["speeds"][-1], _HIGHEST)])
        artists["fastest"].set_data(fastest.s, fastest.rate)
        here = fastest.progress(now)
        artists["now"].set_data([here[0]], [here[1]])
        move_box(artists["box"], fastest(now), EDGES)
        V, A = fastest(now, 1), fastest(now, 2)
        used = np.linalg.norm([V[:3], V[3:], A[3:]], axis=1) / most
        names = [n for n, x in zip(("ω", "v", "a"), used, strict=True) if x > _IN_USE]
        return {
            "fastest": f"{numbers(fastest.domain[1], 2)} s",
            "one rate": f"{numbers(3 / rate, 2)} s",
            "used now (ω, v, a)": f"{numbers(100 * used, 0)} %",
            "at its limit": " and ".join(names) or "none",
        }

    name = "As fast as the limits allow"
    return Explorer(name, fig, artists, controls, show, plays="t", seconds=6.0)
