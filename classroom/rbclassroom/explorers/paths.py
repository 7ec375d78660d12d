"""Explorers of motions through many rotations or poses, and of their fastest timing."""

from functools import lru_cache
from typing import Any

import numpy as np

import rbcourse as rb
from rbclassroom.explorers import widgets
from rbclassroom.explorers.explorer import Explorer, new_figure, new_line, new_space, numbers
from rbclassroom.explorers.names import new_name, put_name
from rbclassroom.figures.lesson15 import highest_rates
from rbcourse.draw.bodies import draw_box, move_box
from rbcourse.draw.save import COLOURS, PALE
from rbcourse.draw.spheres import draw_sphere

POSES = rb.pose_from_coordinates(
    [
        [0.0, 0.0, 0.0, -1.1, -1.4, -0.7],
        [0.0, 0.9, 0.8, -0.8, 0.1, 0.9],
        [0.8, 0.4, 1.8, 1.1, -0.2, 0.0],
        [0.0, 0.6, 2.8, 1.4, 1.0, 1.0],
    ]
)
"""Four poses: σ in rad and d in m."""
SHARES = np.array([0.0, 0.35, 0.65, 1.0])
"""The times of the four poses, as fractions of the duration."""
JOINED = ["geodesics", "cubics, parabolas", "cubics, spline", "the optimum"]
EDGES = np.array([0.9, 0.6, 0.3])
"""The edges of the box in m."""
_LONGEST = 12.0
_WAYS = {"angular speed (rad/s)": 2.5, "speed (m/s)": 3.5}

LIMITS = "angular_speed", "speed", "acceleration"
_HIGHEST = 2.0
_IN_USE = 0.995

ANGLES = np.array([[-60.0, 0, 0], [-10, 40, 0], [50, -20, 30], [90, 20, 0]])
"""Yaw, pitch and roll of four orientations, in degrees."""
KINDS = {"parabolas": "z", "spline": "path"}
_STEEPEST = 8.0
_BETWEEN = np.linspace(0, 1, 25)


def spline_explorer() -> Explorer:
    """Return an explorer of two curves through four rotations, with their accelerations over time.

    Both curves are projected cubics. The left curve has the velocities of parabolas, the right
    curve those of the spline. On each sphere of directions, a line is the path of the first body
    axis, a short stroke shows the third axis, and dots are the given orientations. Below each
    sphere, a line shows ‖ω′‖ up to the present time (beyond BK 12, beyond BK 13).
    """
    with new_figure() as fig:
        artists: dict[str, Any] = {}
        for i, (kind, colour) in enumerate(KINDS.items()):
            ax: Any = fig.add_axes((0.48 * i + 0.06, 0.4, 0.48, 0.54), projection="space")
            draw_sphere(ax)
            ax.view_init(elev=20, azim=12)
            below = fig.add_axes((0.11 + 0.48 * i, 0.18, 0.38, 0.21))
            below.set(xlim=(0, 4), ylim=(0, _STEEPEST), xticks=[0, 1, 2, 3, 4], yticks=[0, 3, 6])
            below.set_xlabel("time (s)")
            below.tick_params(labelleft=i == 0)
            look: Any = {"color": COLOURS[colour]}
            fig.text(0.3 + 0.48 * i, 0.94, kind, ha="center", **look)
            dot: Any = {"color": "black", "marker": "o", "ls": "", "clip_on": False}
            artists |= {
                f"{kind} path": new_line(ax, **look, lw=2),
                f"{kind} given": new_line(ax, color=COLOURS["reference"], marker="o", ls="", ms=7),
                f"{kind} up": new_line(ax, color="black", lw=2.5),
                f"{kind} now": new_line(ax, color="black", marker="o", ls="", ms=5),
                f"{kind} joints": below.vlines([], 0, _STEEPEST, color=PALE, lw=1, ls=":"),
                f"{kind} ‖ω′‖": new_line(below, **look),
                f"{kind} ‖ω′‖ now": new_line(below, **dot),
            }
        fig.text(0.02, 0.42, r"$\Vert\omega'\Vert$ (rad/s²)")
    controls = {
        "ends": widgets.choice("ends", ["natural", "at rest"]),
        "pitch": widgets.slider("third pitch (°)", -40.0, -60.0, 60.0, 5.0),
        "third": widgets.slider("third time (s)", 2.0, 2.0, 3.0, 0.1),
        "t": widgets.stepped("time t (s)", 0.6, 0.0, 4.0, 0.05),
    }

    def show(ends: str, pitch: float, third: float, t: float) -> dict[str, str]:
        times, R, curves, shares = _two_splines(ends, pitch, third)
        said = {}
        for kind, (curve, inside, path, a) in zip(KINDS, curves, strict=True):
            now = curve(t)
            artists[f"{kind} path"].set_data_3d(*path[:, :, 0].T)
            artists[f"{kind} given"].set_data_3d(*R[:, :, 0].T)
            artists[f"{kind} up"].set_data_3d(*(now[:, :1] + now[:, 2:] * [0, 0.35]))
            artists[f"{kind} now"].set_data_3d(*now[:, :1])
            lines = [[(x, 0), (x, _STEEPEST)] for x in times[1:-1]]
            artists[f"{kind} joints"].set_segments(lines)
            artists[f"{kind} ‖ω′‖"].set_data(inside[inside <= t], a[inside <= t])
            artists[f"{kind} ‖ω′‖ now"].set_data([t], [np.linalg.norm(curve(t, 2))])
            jumps = np.linalg.norm(curve.jumps(2), axis=1)[times[1:-1] <= t]
            jumped = f"by {numbers(jumps, 2)} rad/s²" if len(jumps) else "not yet"
            said[f"{kind}: ω′ jumps"] = jumped
        for kind, share in zip(KINDS, shares, strict=True):
            said[f"{kind}: cost"] = f"{numbers(share, 3)} × the least"
        return said

    name = "Four orientations, two curves"
    return Explorer(name, fig, artists, controls, show, plays="t")


@lru_cache(maxsize=64)
def _two_splines(ends: str, pitch: float, third: float) -> tuple[Any, ...]:
    """Return times and rotations, the drawn data of each curve, and costs divided by the least."""
    times, angles = np.array([0, 1, third, 4]), ANGLES.copy()
    angles[2, 1] = pitch
    R = rb.matrix_from_zyx(np.radians(angles))
    conditions: Any = "rest" if ends == "at rest" else "natural"
    w = rb.bessel_velocities(times, R)
    w[[0, -1]] *= ends == "natural"
    starts, h = times[:-1, None], np.diff(times)[:, None]
    # times on both sides of each knot
    inside = np.nextafter(starts + h * _BETWEEN, starts).ravel()
    inside[:: len(_BETWEEN)] = times[:-1]
    splines = rb.chain(times, R, w), rb.projected_spline(times, R, conditions)
    curves = [(c, inside, c(inside), np.linalg.norm(c(inside, 2), axis=-1)) for c in splines]
    least = rb.minimum_acceleration_spline(times, R, conditions).cost
    return times, R, curves, [rb.acceleration_cost(c) / least for c in splines]


def chain_explorer() -> Explorer:
    """Return an explorer of a box that moves through four poses.

    There are four curves: geodesics, projected cubics with the velocities of parabolas, projected
    cubics with the velocities of the spline, and the optimum. All except the geodesics are at rest
    at both ends (BK 6.3, beyond BK 14).
    """
    with new_figure() as fig:
        space = new_space(fig, (-0.06, -0.1, 0.74, 1.2), 2.15)
        artists: dict[str, Any] = {
            "way": new_line(space, color=COLOURS["path"]),
            "poses": space.plot(*POSES[:, :3, 3].T, "o", color=COLOURS["reference"])[0],
            "box": draw_box(space, POSES[0], EDGES),
        }
        for i, (name, high) in enumerate(_WAYS.items()):
            ax = fig.add_axes((0.66, 0.64 - 0.46 * i, 0.31, 0.27))
            ax.set(xlim=(0, _LONGEST), ylim=(0, high), xticks=[0, 4, 8, 12], title=name)
            artists |= {
                f"{name} joints": ax.vlines([], 0, high, color=PALE, lw=1, ls=":"),
                name: new_line(ax, color=COLOURS["path"]),
                f"{name} now": new_line(ax, color="black", marker="o", ls="", clip_on=False),
            }
        ax.set_xlabel("time (s)")
    controls = {
        "curve": widgets.menu("joined by", JOINED),
        "duration": widgets.slider("duration (s)", 6.0, 4.0, _LONGEST, 0.5),
        "t": widgets.stepped("time t", 0.5, 0.0, 1.0, 0.01),
    }

    def show(curve: str, duration: float, t: float) -> dict[str, str]:
        motion, times, path, speeds, texts = _through_poses(curve, duration)
        now, knots = t * duration, duration * SHARES
        artists["way"].set_data_3d(*path.T)
        move_box(artists["box"], motion(now), EDGES)
        here = _norms(motion(now, 1))
        for i, (name, high) in enumerate(_WAYS.items()):
            artists[name].set_data(times, speeds[:, i])
            artists[f"{name} now"].set_data([now], here[:, i])
            artists[f"{name} joints"].set_segments([[(k, 0), (k, high)] for k in knots[1:-1]])
        return texts

    return Explorer("Through four poses", fig, artists, controls, show, plays="t", seconds=6.0)


@lru_cache(maxsize=64)
def _through_poses(curve: str, duration: float) -> tuple[Any, ...]:
    """Return the motion, times with its positions and speeds, and the texts."""
    knots, times = duration * SHARES, np.linspace(0, duration, 241)
    motion, best = _joined(curve, knots), _joined(JOINED[-1], knots)
    speeds = _norms(motion(times, 1))
    fastest, strongest = speeds.max(axis=0), _norms(motion(times, 2)).max(axis=0)
    jumps = [_norms(motion.jumps(order))[:, 0].max() for order in (1, 2)]
    cost = "infinite: ω jumps"
    if curve != JOINED[0]:
        costs = [rb.acceleration_cost_parts(c)[0] for c in (motion, best)]
        cost = f"{numbers(costs[0] / costs[1], 3)} × the least"
    texts = {
        "fastest": f"{numbers(fastest[0], 2)} rad/s, {numbers(fastest[1], 2)} m/s",
        "strongest": f"{numbers(strongest[0], 2)} rad/s², {numbers(strongest[1], 2)} m/s²",
        "ω jumps": f"by {numbers(jumps[0], 2)} rad/s",
        "ω′ jumps": f"by {numbers(jumps[1], 2)} rad/s²",
        "cost of turning": cost,
    }
    return motion, times, motion(times)[:, :3, 3], speeds, texts


def _joined(curve: str, knots: rb.Array) -> Any:
    if curve == JOINED[0]:
        return rb.chain(knots, POSES, leg=rb.geodesic)
    if curve == JOINED[1]:
        w = rb.bessel_velocities(knots, POSES) * [[0], [1], [1], [0]]
        return rb.chain(knots, POSES, w)
    spline = rb.projected_spline if curve == JOINED[2] else rb.minimum_acceleration_spline
    return spline(knots, POSES, "rest")


def _norms(vectors: rb.Array) -> rb.Array:
    """Return the norms of both halves of vectors with six entries, shape (n, 2)."""
    return np.linalg.norm(vectors.reshape(-1, 2, 3), axis=-1)


def timing_explorer() -> Explorer:
    """Return an explorer of the fastest timing of a path within limits.

    The right picture is the phase plane: the rate of the path parameter s against s, with a pose at
    each integer s. No timing may lie above the limit curves. The grey line is the timing at a
    constant rate. The box moves with the fastest timing (beyond BK 16).
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
