"""Explorers of geodesics and projected lines, screws, and a free rigid body."""

from functools import lru_cache
from typing import Any

import numpy as np

import rbcourse as rb
from rbclassroom.explorers import widgets
from rbclassroom.explorers.explorer import Explorer, apart, new_figure, new_line, new_space, numbers
from rbclassroom.explorers.names import new_name, put_name
from rbcourse.draw.bodies import draw_box, move_box
from rbcourse.draw.save import COLOURS
from rbcourse.draw.spheres import AZIMUTH, ELEVATION
from rbcourse.straight_line import line_singular_value, theta

_TIMES = np.linspace(0, 1, 101)
_SIDE = 0.8
_EDGES = np.array([0.20, 0.13, 0.03])  # edges of a book of half a kilogram, in m
_MOMENTS = np.diag(rb.Body.box(_EDGES, 0.5).inertia)
_SPIN_TIMES = np.linspace(0, 8, 201)
_OFF_MOST, _OFF_STEP = 20.0, 0.5
_SPINS = {"axis 1": 0, "axis 2": 1, "axis 3": 2}
_SEEN_FIRST = np.array([0.8, 0.8, 1])  # at the start the ends with a number are in front


def theta_explorer() -> Explorer:
    """Return an explorer of the line between two rotations, and of its projection θ(t).

    The left picture shows the circle of the rotations between the two ends, with the chord; the
    right picture shows θ against time. A click on the left picture sets the time (BK Prop. 6,
    BK (15), BK (16), BK Cor. 1, BK Fig. 2).
    """
    with new_figure() as fig:
        ax = fig.add_axes((0.0, 0.1, 0.58, 0.82))
        # the height 0 is that of the right picture
        ax.set(xlim=(-1.06, 1.3), ylim=(-0.221, 1.25), aspect="equal", anchor="SW")
        ax.set_axis_off()
        side = fig.add_axes((0.665, 0.18, 0.31, 0.72))
        side.set(xlim=(0, 1), ylim=(0, 1), xticks=[0, 0.5, 1], yticks=[0, 0.5, 1])
        side.set_xlabel("time $t$")
        black: Any = {"color": COLOURS["optimum"]}
        pink: Any = {"color": COLOURS["projection"]}
        side.tick_params("y", pad=8)  # otherwise the dots cover the numbers
        side.plot([0, 1], [0, 1], **black, lw=1.5)
        side.text(0.96, 0.4, "geodesic", ha="right", **black)
        side.text(0.45, 0.85, r"$\theta(t)$", ha="right", **pink)
        ax.text(0, 1.12, "geodesic", ha="center", **black)
        ax.text(0, -0.16, "projection", ha="center", **pink)
        dot: dict[str, Any] = {"marker": "o", "ms": 10, "ls": ""}
        artists = {
            "arc": new_line(ax, **black, lw=2.5),
            "chord": new_line(ax, **black, lw=1),
            "ray": new_line(ax, **pink, ls="--", lw=1.5),
            "even": new_line(ax, **black, **dot, mfc="white"),
            "line": new_line(ax, **black, **{**dot, "ms": 5}),
            "line name": new_name(ax, "line", ha="left", va="top"),
            "shadow": new_line(ax, **pink, **dot),
            "theta": new_line(side, **pink),
            "theta now": new_line(side, **pink, **dot, clip_on=False),
        }
    controls = {
        "angle": widgets.slider("angle a (°)", 120.0, 1.0, 179.0, 1.0),
        "t": widgets.stepped("time t", 0.3, 0.0, 1.0, 0.01),
    }

    def show(angle: float, t: float) -> dict[str, str]:
        a = np.radians(angle)
        ends = np.exp(1j * (np.pi / 2 + a * np.array([0.5, -0.5])))
        shares: dict[str, Any] = {"arc": _TIMES, "even": [t], "shadow": [theta(t, a)]}
        places = {name: ends[0] * np.exp(-1j * a * np.array(s)) for name, s in shares.items()}
        places |= {"chord": ends, "line": ends[:1] + t * (ends[1:] - ends[:1])}
        places["ray"] = np.append(0, places["shadow"])
        for name, where in places.items():
            artists[name].set_data(where.real, where.imag)
        put_name(artists["line name"], [ends[1].real + 0.06, ends[1].imag - 0.04])
        artists["theta"].set_data(_TIMES, theta(_TIMES, a))
        artists["theta now"].set_data([t], [theta(t, a)])
        said = {"θ(t)": theta(t, a), "dθ/dt": theta(t, a, 1)}
        said["s(t), of the line"] = line_singular_value(t, a)
        return {name: f"{value:.3f}" for name, value in said.items()}

    def point(x: float, y: float) -> dict[str, float]:
        across, _ = ax.transData.inverted().transform((x, y))
        half = np.sin(np.radians(controls["angle"].value) / 2)
        return {"t": round(float(np.clip(0.5 + across / (2 * half), 0, 1)), 2)}

    return Explorer("The line and its shadow", fig, artists, controls, show, plays="t", point=point)


def screw_explorer() -> Explorer:
    """Return an explorer of two motions from the fixed frame to a pose: geodesic and screw.

    Source: BK 2.6, BK (10), BK (14).
    """
    with new_figure() as fig:
        ax = new_space(fig, (-0.27, -0.27, 1.51, 1.51), 2.5)
        draw_box(ax, np.eye(4), _SIDE).set_alpha(0.3)
        black, violet = COLOURS["optimum"], COLOURS["screw"]
        artists: dict[str, Any] = {
            "axis": new_line(ax, color=COLOURS["reference"], ls="-.", lw=2),
            "axis name": new_name(ax, "axis of the screw", color=COLOURS["reference"]),
            "geodesic way": new_line(ax, color=black),
            "screw way": new_line(ax, color=violet, ls="--"),
            **{name: draw_box(ax, np.eye(4), _SIDE) for name in ("goal", "geodesic", "screw")},
            "geodesic name": new_name(ax, "geodesic", color=black),
            "screw name": new_name(ax, "screw", color=violet),
        }
        artists["goal"].set_alpha(0.3)
        artists["geodesic"].set_edgecolor(black)
        artists["screw"].set_edgecolor(violet)
    controls = {
        "angle": widgets.slider("turn (°)", 120.0, -180.0, 180.0, 1.0),
        "tilt": widgets.slider("tilt of axis (°)", 0.0, 0.0, 90.0, 1.0),
        "x": widgets.slider("goal x (m)", 2.0, -2.0, 2.0, 0.1),
        "z": widgets.slider("goal z (m)", 0.8, -1.2, 1.2, 0.1),
        "t": widgets.stepped("time t", 0.5, 0.0, 1.0, 0.01),
    }

    def show(angle: float, tilt: float, x: float, z: float, t: float) -> dict[str, str]:
        axis = np.array([np.sin(np.radians(tilt)), 0, np.cos(np.radians(tilt))])
        goal = rb.pose_from_coordinates([*(np.radians(angle) * axis), x, 0, z])
        move_box(artists["goal"], goal, _SIDE)
        poses, said = {}, {}
        for name, curve in {"geodesic": rb.geodesic, "screw": rb.screw}.items():
            way = curve(np.eye(4), goal)
            poses[name] = pose = way(t)
            artists[f"{name} way"].set_data_3d(*way(t * _TIMES)[:, :3, 3].T)
            move_box(artists[name], pose, _SIDE)
            said[f"turned, {name}"] = apart(np.eye(3), pose[:3, :3])
        bolt = rb.screw_from_pose(goal)
        artists["axis"].set_data_3d(*(bolt.point + np.outer([-1.8, 1.8], bolt.axis)).T)
        put_name(artists["axis name"], bolt.point - np.copysign(2, bolt.axis[2]) * bolt.axis)
        above = 0.75 if poses["geodesic"][2, 3] > poses["screw"][2, 3] - 1e-9 else -0.75
        for name, high in (("geodesic", above), ("screw", -above)):
            put_name(artists[f"{name} name"], poses[name][:3, 3] + [0, 0, high])
        far = ", not in sight" if np.linalg.norm(bolt.point) > 3 else ""
        origins = np.linalg.norm((poses["screw"] - poses["geodesic"])[:3, 3])
        return said | {
            "origins apart": f"{numbers(origins, 2)} m",
            "its axis through": f"({numbers(bolt.point, 1)}) m{far}" if angle else "none",
            "slide along it": f"{numbers(bolt.pitch, 2)} m per rad" if angle else "all of the way",
        }

    return Explorer("Geodesic and screw", fig, artists, controls, show, plays="t")


def flip_explorer() -> Explorer:
    """Return an explorer of a book that spins freely, nearly about one of its axes.

    The three axes stick out of the book on both sides, and one end of each axis has a number. The
    angular momentum is vertical and constant. The time starts again when another axis is chosen
    (BK (8), BK 2.4).
    """
    with new_figure() as fig:
        ax = new_space(fig, (-0.05, 0.0, 0.58, 1.0), 0.155)
        ax.view_init(np.degrees(ELEVATION), np.degrees(AZIMUTH))
        side = fig.add_axes((0.61, 0.18, 0.37, 0.68))
        side.set(xlim=(0, 8), ylim=(-4.4, 4.4), xlabel="time $t$ (s)")
        side.set_ylabel(r"$\omega$ (rad/s)")
        side.set_xticks([0, 2, 4, 6, 8])
        artists: dict[str, Any] = {"book": draw_box(ax, np.eye(4), _EDGES)}
        for i, (axis, dash) in enumerate(zip("xyz", ("-", "--", "-."), strict=True), 1):
            artists[f"axis {i}"] = new_line(ax, color=COLOURS[axis], lw=3.5)
            artists[f"number {i}"] = new_name(ax, f"{i}", color=COLOURS[axis])
            name = rf"$\omega_{i}$"
            artists[f"w{i}"] = new_line(side, color=COLOURS[axis], ls=dash, label=name)
        artists["now"] = side.axvline(0, color="black", lw=1.5)
        above: Any = {"loc": "lower center", "bbox_to_anchor": (0.4, 1)}
        side.legend(**above, ncols=3, handlelength=1.8, columnspacing=0.6)
    controls = {
        "axis": widgets.choice("spin about", list(_SPINS)),
        "off": widgets.slider("off axis by (°)", 4.0, 0.0, _OFF_MOST, _OFF_STEP),
        "t": widgets.stepped("time t (s)", 1.56, 0.0, 8.0, 0.04),
    }

    def show(axis: str, off: float, t: float) -> dict[str, str]:
        R, w = (part[:, _SPINS[axis], round(off / _OFF_STEP)] for part in _spins())
        k = round(t / 8 * (len(_SPIN_TIMES) - 1))
        move_box(artists["book"], rb.pose_from_components(R[k], np.zeros(3)), _EDGES)
        for i, half in enumerate(_EDGES / 2):
            ends = np.outer(R[k, :, i], half * np.array([-1, 1]) + [-0.055, 0.055])
            artists[f"axis {i + 1}"].set_data_3d(*ends)
            put_name(artists[f"number {i + 1}"], (half + 0.085) * R[k, :, i])
            artists[f"w{i + 1}"].set_data(_SPIN_TIMES[: k + 1], w[: k + 1, i])
        artists["now"].set_xdata([t, t])
        itself = w[: k + 1, _SPINS[axis]]
        times_over = np.count_nonzero(np.diff(itself > 0))
        return {
            "ω": f"({numbers(w[k], 2)}) rad/s",
            f"of {axis} itself": f"{numbers(itself[-1], 2)} rad/s",
            "turned over": f"{times_over} times" if times_over != 1 else "once",
        }

    controls["axis"].observe(lambda _: controls["t"].set_trait("value", 0.0), "value")
    return Explorer("A book that spins", fig, artists, controls, show, plays="t", seconds=8)


@lru_cache(maxsize=1)
def _spins() -> tuple[rb.Array, rb.Array]:
    """Return the orientations and angular velocities for all times, axes, and angles off the axis.

    All motions are integrated in advance, because an integration is too slow while a slider moves.
    """
    tilt = np.radians(np.arange(0, _OFF_MOST + _OFF_STEP / 2, _OFF_STEP))[:, None]
    main = np.eye(3)[:, None]
    w0 = 4 * (np.cos(tilt) * main + np.sin(tilt) * (1 - main) / np.sqrt(2))
    L = _MOMENTS * w0 / np.linalg.norm(_MOMENTS * w0, axis=-1, keepdims=True)
    ahead = _SEEN_FIRST - (L @ _SEEN_FIRST)[..., None] * L
    ahead /= np.linalg.norm(ahead, axis=-1, keepdims=True)
    body = np.stack([ahead, np.cross(L, ahead), L], axis=-2)
    upright = rb.exp_so3([0, 0, AZIMUTH]) @ body  # the angular momentum points up
    return rb.connection.geodesic_flow(np.diag(_MOMENTS), upright, w0, _SPIN_TIMES)
