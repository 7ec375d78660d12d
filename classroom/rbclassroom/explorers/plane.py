"""Explorers of the plane: a body that follows a plan, and the two-link arm."""

from typing import Any

import numpy as np

from rbclassroom.explorers import widgets
from rbclassroom.explorers.explorer import Explorer, look, new_figure, new_line, numbers
from rbcourse import Array
from rbcourse.arm import LINKS, arm_forward_kinematics, arm_inverse_kinematics, interpolate_joints
from rbcourse.draw.arm import show_reach
from rbcourse.draw.plane import draw_body, move_body
from rbcourse.draw.save import COLOURS
from rbcourse.planar import propagate_planar

_STEPS = 80
_LASTS = 2.0  # each command, in s
_BODY = 1.3
_FRAMES = {"world": (COLOURS["z"], "#D6E6F2", "-"), "body": (COLOURS["x"], "none", "--")}
_START, _GOAL = (-20.0, 110.0), (130.0, -60.0)


def planar_explorer() -> Explorer:
    """Return an explorer of plans: two commands, meant in the world's frame or in the body's.

    Controls: ``vx1 vy1 omega1`` and ``vx2 vy2 omega2``, the velocities of the two commands of two
    seconds each, in m/s and degrees/s, and the time ``t`` in s, which plays (RR 3.2, RR (17), RR
    (18), RR (19)).
    """
    with look():
        fig = new_figure()
        ax = fig.add_axes((0.12, 0.15, 0.87, 0.73))
        ax.set(xlim=(-7.75, 7.75), ylim=(-4.9, 4.9), xlabel="x (m)", ylabel="y (m)")
        ax.set_aspect("equal")
        artists: dict[str, Any] = {}
        for frame, (colour, fill, ls) in _FRAMES.items():
            artists[f"{frame} plan"] = new_line(ax, color=colour, ls=ls, lw=1, alpha=0.4)
            artists[f"{frame} way"] = new_line(
                ax, color=colour, ls=ls, label=f"axes of the {frame}"
            )
            outline, nose = draw_body(ax, np.zeros(3), _BODY, colour, fill=fill, ls=ls)
            artists |= {f"{frame} outline": outline, f"{frame} nose": nose}
        fig.legend(loc="upper center", ncols=2)
    controls = {
        f"{name}{i + 1}": widgets.slider(f"{nth} {symbol} ({unit})", first, -high, high, step)
        for i, nth in enumerate(("1st", "2nd"))
        for name, symbol, unit, first, high, step in (
            ("vx", "vx", "m/s", 1.0, 1.0, 0.1),
            ("vy", "vy", "m/s", 0.0, 1.0, 0.1),
            ("omega", "vθ", "°/s", 0.0, 90.0, 5.0),
        )
    }

    def show(t: float, **velocities: float) -> dict[str, str]:
        paths = plan_paths(**velocities)
        now = round(t / (2 * _LASTS) * _STEPS)
        said = {}
        for frame, path in paths.items():
            artists[f"{frame} plan"].set_data(*path[:, :2].T)
            artists[f"{frame} way"].set_data(*path[: now + 1, :2].T)
            body = [artists[f"{frame} outline"], artists[f"{frame} nose"]]
            move_body(body, path[now], _BODY)
            x_y, heading = numbers(path[now, :2], 2), numbers(np.degrees(path[now, 2]), 0)
            said[frame] = f"({x_y}) m, heading {heading}°"
        return said

    controls["t"] = widgets.stepped("time t (s)", 0.0, 0.0, 2 * _LASTS, 2 * _LASTS / _STEPS)
    return Explorer("A plan of two commands", fig, artists, controls, show, plays="t")


def plan_paths(
    vx1: float, vy1: float, omega1: float, vx2: float, vy2: float, omega2: float
) -> dict[str, Array]:
    """Return the poses that the two commands lead through, by the frame they are meant in."""
    plan = [
        (np.array([vx, vy, np.radians(omega)]), 2 * _LASTS / _STEPS)
        for vx, vy, omega in ((vx1, vy1, omega1), (vx2, vy2, omega2))
        for _ in range(_STEPS // 2)
    ]
    return {frame: propagate_planar(np.zeros(3), plan, frame=frame) for frame in _FRAMES}


def arm_explorer() -> Explorer:
    """Return an explorer of the two-link arm: set its angles, or click where its hand is to be.

    A pale arm shows where it starts; both motors run evenly from there. Controls: the goal
    ``theta0`` and ``theta1``, in degrees, and the time ``t`` in [0, 1], which plays. Who sets a
    goal sees the arm there (RR 4, RR 4.1, RR (20), RR (21)).
    """
    start = np.radians(_START)
    with look():
        fig = new_figure()
        ax = fig.add_axes((0.12, 0.15, 0.63, 0.84))
        show_reach(ax)
        ax.plot(*arm_forward_kinematics(start).joints.T, "o-", color="0.75", lw=4, ms=8)
        artists: dict[str, Any] = {
            "way": new_line(ax, color=COLOURS["path"], lw=2.5, label="its way"),
            "goal": new_line(
                ax, marker="x", ls="", color=COLOURS["path"], ms=12, mew=3, label="goal"
            ),
            "links": new_line(ax, marker="o", color=COLOURS["z"], lw=5, ms=9, label="arm"),
        }
        fig.legend(loc="upper right", handlelength=1)
    controls = {
        "theta0": widgets.slider("shoulder θ₀ (°)", _GOAL[0], -180.0, 180.0, 1.0),
        "theta1": widgets.slider("elbow θ₁ (°)", _GOAL[1], -180.0, 180.0, 1.0),
        "t": widgets.stepped("time t", 0.0, 0.0, 1.0, 0.01),
    }

    def show(theta0: float, theta1: float, t: float) -> dict[str, str]:
        goal = np.radians([theta0, theta1])
        q = start + t * (goal - start)
        joints = arm_forward_kinematics(q).joints
        artists["links"].set_data(*joints.T)
        way = arm_forward_kinematics(interpolate_joints(start, q, 60)).joints[:, -1]
        artists["way"].set_data(*way.T)
        artists["goal"].set_data(*arm_forward_kinematics(goal).joints[-1:].T)
        return {
            "angles": f"({numbers(np.degrees(q), 1)})°",
            "hand": f"({numbers(joints[-1], 2)}) m",
        }

    def point(x: float, y: float) -> dict[str, float]:
        place = ax.transData.inverted().transform((x, y))
        left, right = np.degrees(arm_inverse_kinematics(place, LINKS))
        theta0, theta1 = left if controls["theta1"].value >= 0 else right
        return {"theta0": theta0, "theta1": theta1, "t": 1.0}

    for name in ("theta0", "theta1"):
        controls[name].observe(lambda _: controls["t"].set_trait("value", 1.0), "value")
    return Explorer("The arm", fig, artists, controls, show, plays="t", point=point)
