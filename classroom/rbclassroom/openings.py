"""Moving pictures of failures, one for the first screen of each lesson.

Each function returns an animation with a number that states what the failure costs. Where two
motions are compared, the left panel shows the failure.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Circle

import rbcourse as rb
from rbclassroom.figures import lesson13, lesson16
from rbcourse import Array, Curve
from rbcourse.draw import arm, bodies, plane, spheres
from rbcourse.draw.animate import Animation, Update, animate
from rbcourse.draw.save import COLOURS

FRAMES = 50
T = np.linspace(0, 1, FRAMES)
"""The times of the frames, where a motion takes the time 1."""
WRONG, RIGHT = "what the program did", "what was meant"
_I, _REST = np.eye(3), np.zeros(3)
_GRIPPER = np.array([1.6, 1.0, 0.4])
_STYLES = ["default", "rbcourse.rbcourse"]


@contextmanager
def _panels(*kinds: str) -> Iterator[tuple[Figure, list[Any]]]:
    """Yield a figure in the style of the course, and axes with these Matplotlib projections."""
    with plt.style.context(_STYLES):
        fig = Figure(figsize=(7, 2.9), dpi=80)
        fig.set_layout_engine("constrained", rect=(0, 0.12, 1, 0.88))  # the notes are below
        axes = [fig.add_subplot(1, len(kinds), k + 1, projection=x) for k, x in enumerate(kinds)]
        yield fig, axes


def _animation(
    fig: Figure,
    lesson: int,
    alt: str,
    move: Update,
    notes: Sequence[Sequence[str]],
    still: int,
    seconds: float = 5.0,
) -> Animation:
    """Return a figure as an animation; `notes` has a text for each panel and each frame."""
    places = (np.arange(len(notes)) + 0.5) / len(notes)
    texts = [fig.text(x, 0.03, "", ha="center", va="baseline") for x in places]

    def update(i: int) -> list[Any]:
        for text, said in zip(texts, notes, strict=True):
            text.set_text(said[i])
        return [*move(i), *texts]

    name = f"opening{lesson:02}"
    return animate(fig, name, alt, update, len(notes[0]), seconds, still, gif=False)


def _compare(
    lesson: int,
    alt: str,
    motions: Mapping[str, Array],
    notes: Sequence[Sequence[str]],
    still: int,
    seconds: float = 5.0,
) -> Animation:
    """Return an animation of a box that is mapped by 3 × 3 matrices, in two panels."""
    with _panels("space", "space") as (fig, axes):
        placed = {name: _placed(M) for name, M in motions.items()}
        move = bodies.moving_boxes(axes, placed, _GRIPPER)
        return _animation(fig, lesson, alt, move, notes, still, seconds)


def _placed(M: Array) -> Array:
    """Return 4 × 4 matrices from 3 × 3 matrices, which need not be rotations."""
    A = np.zeros((len(M), 4, 4))
    A[:, :3, :3], A[:, 3, 3] = M, 1
    return A


def _turned(R: Array) -> Array:
    """Return the sum of the turns from frame to frame, up to each frame, in degrees."""
    return np.degrees(np.cumsum(np.append(0, rb.angle_between(R[:-1], R[1:]))))


def _said(form: str, values: Array) -> list[str]:
    """Return values as texts, one for each frame."""
    return [form.format(x + 0.0).replace("-", "−") for x in values]


def _cameras(axes: Sequence[Any], motions: Mapping[str, Array], targets: Array) -> Update:
    """Draw a camera with its line of sight for each motion, and a dot at each of the targets."""
    boxes = {name: _placed(R) for name, R in motions.items()}
    move = bodies.moving_boxes(axes, boxes, np.array([0.9, 0.6, 0.6]))
    sights = [ax.plot([], [], [], color=COLOURS["path"], lw=3)[0] for ax in axes]
    dots = [ax.plot([], [], [], "o", color=COLOURS["optimum"], ms=9)[0] for ax in axes]
    for ax in axes:
        ax.fit(np.full(3, -1.1), np.full(3, 1.1), zoom=1.5)

    def update(i: int) -> list[Any]:
        for sight, dot, R in zip(sights, dots, motions.values(), strict=True):
            sight.set_data_3d(*np.outer([0, 1.2], R[i, :, 0]).T)
            dot.set_data_3d(*1.3 * targets[i, :, None])
        return [*move(i), *sights, *dots]

    return update


def gripper_that_flips() -> Animation:
    """Lesson 0: a gripper turns the long way, since the components of quaternions are blended.

    The number is the angle by which it turns.
    """
    q0, q1 = rb.quaternion_from_matrix(rb.exp_so3([[0, 0, 2.9], [0, 0, 3.4]]))
    blend = rb.quaternion.project_quaternion(q0 + T[:, None] * (q1 - q0))
    paths = {WRONG: blend, RIGHT: rb.slerp(q0, q1, T)}
    motions = {name: rb.matrix_from_quaternion(q) for name, q in paths.items()}
    turned = [_turned(R) for R in motions.values()]
    long, short = (f"{x[-1]:.0f}" for x in turned)
    alt = f"A gripper turns by {long}° to an orientation that is only {short}° away."
    return _compare(0, alt, motions, [_said("turned by {:.0f}°", x) for x in turned], 26)


def car_that_slides() -> Animation:
    """Lesson 1: the position and the heading of a car are blended evenly, and the car slides.

    The number is the angle between its nose and its direction of travel.
    """
    goal = [5, 2.5, np.pi / 2]
    straight = [([2.5 / 20, 0, 0], 1)] * 20
    bend = [([2.5 * np.pi / 58, 0, np.pi / 58], 1)] * 29  # a quarter of a circle
    wrong = rb.planar.interpolate_planar([0, 0, 0], goal, FRAMES - 1)
    right = rb.planar.propagate_planar([0, 0, 0], straight + bend, frame="body")
    slip = np.degrees(np.abs(wrong[:, 2] - np.arctan2(goal[1], goal[0])))
    alt = f"A car slides sideways: it moves at up to {slip.max():.0f}° to its nose."
    with _panels("rectilinear", "rectilinear") as (fig, axes):
        moves = [plane.moving_route(*x, 1.2, [0, -1]) for x in zip(axes, (wrong, right), strict=True)]
        for ax, title in zip(axes, ("what the program did", "what a car can do"), strict=True):
            ax.set(title=title, xlim=(-0.9, 6), ylim=(-0.7, 3.3), xlabel="", ylabel="")
        notes = [_said("slides at {:.0f}° to its nose", x) for x in (slip, 0 * slip)]
        return _animation(fig, 1, alt, lambda i: [*moves[0](i), *moves[1](i)], notes, -1)


def hand_that_hits_a_glass() -> Animation:
    """Lesson 2: both motors of an arm turn evenly, and its hand takes a detour and hits a glass.

    The number is the length of the path of the hand.
    """
    start, goal = np.radians([-20, 20]), np.radians([160, 120])
    wrong = rb.arm.interpolate_joints(start, goal, FRAMES - 1)
    tips = rb.arm.arm_forward_kinematics(wrong).joints[:, -1]
    line = tips[0] + T[:, None] * (tips[-1] - tips[0])
    right = np.unwrap(rb.arm.arm_inverse_kinematics(line)[:, 0], axis=0)
    ways = [np.linalg.norm(np.diff(x, axis=0), axis=1).cumsum() for x in (tips, line)]
    far, near = (f"{way[-1]:.1f}" for way in ways)
    alt = f"The hand of an arm hits a glass: its path is {far} m long instead of {near} m."
    glass, hit = tips[FRAMES // 2], 0.25
    with _panels("rectilinear", "rectilinear") as (fig, axes):
        moves = [arm.moving_arm(*x, [0, -1]) for x in zip(axes, (wrong, right), strict=True)]
        for ax, title in zip(axes, (WRONG, RIGHT), strict=True):
            ax.set(title=title, xlabel="", ylabel="", xticks=[], yticks=[], ylim=(-1.2, 3.8))
        cups = [ax.add_patch(Circle(glass, hit, fc="white", ec="black", zorder=5)) for ax in axes]

        def update(i: int) -> list[Any]:
            broken = np.linalg.norm(tips[i] - glass) < hit or i > FRAMES // 2
            cups[0].set_facecolor(COLOURS["path"] if broken else "white")
            return [*moves[0](i), *moves[1](i), *cups]

        notes = [_said("the hand covers {:.1f} m", np.append(0, way)) for way in ways]
        return _animation(fig, 2, alt, update, notes, -1)


def camera_that_loses_its_target() -> Animation:
    """Lesson 3: the motors of a camera cannot follow a target that passes nearly overhead.

    The number is the largest error of the orientation.
    """
    seconds, limit, times = 4.0, np.radians(60), np.linspace(0, 4, 401)  # s, rad/s
    wanted = rb.exp_so3(-np.pi / seconds * times[:, None] * _I[1])
    wanted = wanted @ rb.exp_so3(-np.radians(1) * _I[2])
    angles = np.unwrap(rb.zyx_from_matrix(wanted), axis=0)
    for i, step in enumerate(np.diff(times), start=1):
        reached = angles[i - 1] + np.clip(angles[i] - angles[i - 1], -limit * step, limit * step)
        angles[i] = reached
    motions = {"what the motors did": rb.matrix_from_zyx(angles)[::8], "what was wanted": wanted[::8]}
    off = np.degrees(rb.angle_between(*motions.values()))
    alt = f"A camera with three motors loses its target: it points up to {off.max():.0f}° away."
    with _panels("space", "space") as (fig, axes):
        move = _cameras(axes, motions, motions["what was wanted"][:, :, 0])
        notes = [_said("off by {:.0f}°", x) for x in (off, 0 * off)]
        return _animation(fig, 3, alt, move, notes, int(off.argmax()), seconds)


def box_that_grows() -> Animation:
    """Lesson 4: a matrix is multiplied by I + h ω̂ in 400 steps, and the box grows.

    The number is the growth perpendicular to the axis.
    """
    factor, M, fixed, kept = _I + rb.hat_so3([0.015, -0.04, 0.025]), _I, _I, [(_I, _I)]
    for count in range(1, 401):
        M, fixed = M @ factor, fixed @ factor
        if count % 8 == 0:
            fixed = rb.project_so(fixed)
            kept.append((M, fixed))
    both = np.array(kept)
    growth = 100 * np.linalg.svd(both, compute_uv=False)[..., 0] - 100
    alt = f"A box in a simulation grows by {growth[-1, 0]:.0f} % in 400 steps."
    motions = {"400 steps": both[:, 0], "with repairs": both[:, 1]}
    return _compare(4, alt, motions, [_said("grown by {:.0f} %", x) for x in growth.T], -1)


def spray_robot() -> Animation:
    """Lesson 5: the nozzle of a robot points along random directions, and most paint is at the poles.

    The number is the share of 1,000 dots within 30° of a pole.
    """
    samples = {
        "three uniform angles": rb.sampling.sample_rotation_naive(1000, rng=5)[:, :, 0],
        "uniform rotations": rb.sample_rotation(1000, rng=5)[:, :, 0],
    }
    counts = np.arange(20, 1001, 20)
    near = [np.abs(x[:, 2]) > np.cos(np.radians(30)) for x in samples.values()]
    shares = [100 * x.cumsum()[counts - 1] / counts for x in near]
    area = 100 * (1 - np.cos(np.radians(30)))
    alt = (
        f"A robot sprays dots on a sphere: {shares[0][-1]:.0f} % of them are within 30° of a pole, "
        f"on {area:.0f} % of the area."
    )
    with _panels("space", "space") as (fig, axes):
        dots = [_dots(ax, title) for ax, title in zip(axes, samples, strict=True)]

        def update(i: int) -> list[Any]:
            for dot, x in zip(dots, samples.values(), strict=True):
                dot.set_data_3d(*x[: counts[i]].T)
            return dots

        notes = [_said("{:.0f} % near the poles", x) for x in shares]
        return _animation(fig, 5, alt, update, notes, -1)


def _dots(ax: Any, title: str) -> Any:
    """Draw a sphere whose pole is visible, with circles 30° from the poles; return empty dots."""
    spheres.draw_sphere(ax)
    ax.view_init(elev=45, azim=-60)
    ax.set_title(title)
    turn = np.linspace(0, 2 * np.pi, 49)
    for z in np.cos(np.radians([30, 150])):
        ring = np.sqrt(1 - z**2) * np.array([np.cos(turn), np.sin(turn)])
        ax.plot(*ring, z, color=COLOURS["optimum"], lw=1.5)
    return ax.plot([], [], [], "o", ms=3, mew=0, color=COLOURS["path"])[0]


def box_that_shrinks() -> Animation:
    """Lesson 6: a box is mapped by the matrices on the straight line between two rotations.

    The number is its width in the middle.
    """
    goal = rb.exp_so3([0, 0, np.radians(150)])
    line = _I + T[:, None, None] * (goal - _I)
    width = 100 * np.linalg.svd(line, compute_uv=False)[:, -1]
    alt = f"A box that should only turn by 150° shrinks to {width.min():.0f} % of its width."
    motions = {"straight line of matrices": line, "rotations": rb.geodesic(_I, goal)(T)}
    notes = [_said("{:.0f} % of its width", x) for x in (width, 100 + 0 * width)]
    return _compare(6, alt, motions, notes, FRAMES // 2)


def wrench_that_leaves_its_bolt() -> Animation:
    """Lesson 7: the hand at the end of a wrench moves on a straight line while the wrench turns.

    The number is the largest distance of the nut from the bolt.
    """
    hand, turn = rb.pose_from_coordinates([[0, 0, 0, 0.3, 0, 0], [0, 0, np.radians(150), 0, 0, 0]])
    motions = {
        WRONG: rb.geodesic(hand, turn @ hand)(T) @ rb.inverse_se3(hand),
        RIGHT: rb.screw(hand, turn @ hand)(T) @ rb.inverse_se3(hand),
    }
    off = [100 * np.linalg.norm(A[:, :3, 3], axis=1) for A in motions.values()]
    alt = f"A wrench leaves its bolt: the nut is up to {off[0].max():.0f} cm beside the bolt."
    with _panels("space", "space") as (fig, axes):
        moves = [_wrench(*x) for x in zip(axes, motions, motions.values(), strict=True)]
        notes = [_said("{:.0f} cm off the bolt", x) for x in off]
        return _animation(fig, 7, alt, lambda i: [*moves[0](i), *moves[1](i)], notes, FRAMES // 2)


def _wrench(ax: Any, title: str, nuts: Array) -> Update:
    """Draw a bolt, and a nut with a handle that moves."""
    handle = rb.pose_from_components(_I, [0.16, 0, 0])
    bolt = bodies.draw_box(ax, np.eye(4), np.array([0.03, 0.03, 0.22]))
    bolt.set(colours=["0.7"] * 7)
    parts = [(np.eye(4), np.array([0.09, 0.09, 0.04])), (handle, np.array([0.28, 0.03, 0.02]))]
    boxes = [bodies.draw_box(ax, nuts[0], edges) for _, edges in parts]
    ax.fit([-0.3, -0.05, -0.12], [0.32, 0.3, 0.12], zoom=1.5)
    ax.view_init(elev=35, azim=-80)
    ax.set_title(title)

    def update(i: int) -> list[Any]:
        for box, (place, edges) in zip(boxes, parts, strict=True):
            bodies.move_box(box, nuts[i] @ place, edges)
        return boxes

    return update


def book_that_turns_over() -> Animation:
    """Lesson 8: a book spins freely, nearly about its middle axis, and turns over without a torque.

    The number is the time of the first turn.
    """
    edges, t = np.array([0.20, 0.13, 0.03]), np.linspace(0, 5.9, 60)  # m, s
    J = edges @ edges - edges**2
    spins = np.array([[0.2, 4, 0.2], [0.2, 0.2, 4]])  # rad/s
    up = J * spins / np.linalg.norm(J * spins, axis=1, keepdims=True)  # the angular momentum
    axis = np.cross(up, _I[2])
    tilt = np.arctan2(np.linalg.norm(axis, axis=1), up[:, 2])
    upright = rb.exp_so3(tilt[:, None] * axis / np.linalg.norm(axis, axis=1, keepdims=True))
    R, _ = rb.connection.geodesic_flow(np.diag(J), upright, spins, t)
    height = R[:, 0, 2, 1]
    i = int((height < 0).argmax())
    over = t[i - 1] + (t[i] - t[i - 1]) * height[i - 1] / (height[i - 1] - height[i])
    alt = f"A book that spins about its middle axis turns over after {over:.1f} s, without a torque."
    with _panels("space", "space") as (fig, axes):
        titles = "about the middle axis", "about the shortest axis"
        motions = {title: _placed(R[:, k]) for k, title in enumerate(titles)}
        move = bodies.moving_boxes(axes, motions, edges)
        clock = _said("{:.1f} s", t)
        first = [f"{said}, turned over at {over:.1f} s" if x > over else said for x, said in zip(t, clock, strict=True)]
        return _animation(fig, 8, alt, move, [first, clock], i + 4, seconds=6.0)


def turn_that_snaps() -> Animation:
    """Lesson 9: a projected cubic turns by 170° from rest to rest, nearly all in one moment.

    The number is its cost, as a multiple of the least cost.
    """
    ends = _I, rb.exp_so3([0, 0, np.radians(170)]), _REST, _REST
    curves = {"projected cubic": rb.projected_cubic(*ends), "least acceleration": rb.minimum_acceleration(*ends)}
    alt, notes = "A gripper snaps round in the middle of its turn by 170°", _costs(curves)
    motions = {name: curve(T) for name, curve in curves.items()}
    return _compare(9, f"{alt}; this {notes[0][0]}.", motions, notes, 23)


def _costs(curves: Mapping[str, Curve]) -> list[list[str]]:
    """Return notes with the cost of the first curve, as a multiple of the cost of the second."""
    one, other = map(rb.acceleration_cost, curves.values())
    return [FRAMES * [f"costs {one / other:.0f} times as much"], FRAMES * ["costs 1"]]


def cube_that_comes_from_another_side() -> Animation:
    """Lesson 10: a velocity in the room is passed where a twist in the body frame is expected.

    The number is the largest distance of the two motions.
    """
    A0, A1 = rb.pose_from_coordinates([[0] * 6, [np.pi / 6, 2 * np.pi / 3, np.pi / 2, 8, 10, 12]])
    w, d_dot = np.array([[1.0, 2, 3], [2, 1, 1]]), np.array([[1.0, 1, 1], [20, 0, 20]])
    S0, S1 = rb.twist_from_rates([A0, A1], w, d_dot)
    wrong = rb.minimum_acceleration(A0, A1, S0, np.concatenate([w[1], d_dot[1]]))(T)
    motions = {WRONG: wrong, RIGHT: rb.minimum_acceleration(A0, A1, S0, S1)(T)}
    off = np.linalg.norm((wrong - motions[RIGHT])[:, :3, 3], axis=1)
    alt = f"A cube arrives from another side than was meant, and is up to {off.max():.1f} m off."
    with _panels("space", "space") as (fig, axes):
        move = bodies.moving_boxes(axes, motions, 2)
        notes = [_said("off by {:.1f} m", x) for x in (off, 0 * off)]
        return _animation(fig, 10, alt, move, notes, int(off.argmax()))


def turn_that_goes_back() -> Animation:
    """Lesson 11: a cubic of coordinates brakes, turns back and brakes again.

    The number is its cost, as a multiple of the cost of a curve that keeps turning.
    """
    w = [0, 0, -3]
    ends = _I, rb.exp_so3([0, 0, np.radians(170)]), w, w
    curves = {"exponential": rb.closed_forms.exponential_cubic(*ends), "Bézier": rb.closed_forms.bezier(*ends)}
    alt, notes = "A gripper brakes, turns back and brakes again", _costs(curves)
    motions = {name: curve(T) for name, curve in curves.items()}
    return _compare(11, f"{alt}; this {notes[0][0]}.", motions, notes, FRAMES // 2)


def solver_that_stops_at_a_local_minimum() -> Animation:
    """Lesson 12: a solver finds a certified local minimum that is not the best motion.

    The number is its cost, as a multiple of the least known cost.
    """
    ends = _I, rb.exp_so3(np.radians(135) * np.array([1, 1, 0]) / 2**0.5), [0, 0, 4], [-4, 0, 0]
    found = rb.optimum.stationary(rb.projected_cubic(*ends))
    curves = {"what the solver found": found, "the best known motion": rb.minimum_acceleration(*ends)}
    alt, notes = "A solver finds a local minimum", _costs(curves)
    motions = {name: curve(T) for name, curve in curves.items()}
    return _compare(12, f"{alt}; this {notes[0][0]}.", motions, notes, FRAMES // 2)


def book_taken_for_a_ball() -> Animation:
    """Lesson 13: a book turns on the curve that is best for a ball; bars show the torque.

    The number is the additional cost in torque.
    """
    book, turn = rb.Body.box([0.30, 0.20, 0.03]), np.radians(150) * np.ones(3) / 3**0.5
    ends = _I, rb.exp_so3(turn), _REST, _REST
    curves = {"as if it were a ball": rb.minimum_acceleration(*ends), "least torque": rb.minimum_torque(*ends, body=book)}
    one, other = (rb.torque_cost(curve, body=book) for curve in curves.values())
    more = f"{100 * one / other - 100:.0f} % more torque"
    torque = [np.linalg.norm(lesson13.torques(c, book.inertia, T), axis=1) for c in curves.values()]
    with _panels("space", "space") as (fig, axes):
        placed = {name: _placed(c(T)) for name, c in curves.items()}
        move = bodies.moving_boxes(axes, placed, np.array([0.30, 0.20, 0.03]))
        bars = [fig.add_artist(Line2D([], [], lw=9, color=COLOURS["path"])) for _ in axes]

        def update(i: int) -> list[Any]:
            for k, bar in enumerate(bars):
                bar.set_data(k / 2 + 0.1 + np.array([0, 0.3 * torque[k][i] / np.max(torque)]), [0.16] * 2)
            return [*move(i), *bars]

        alt = f"A book that is turned as if it were a ball needs {more}."
        return _animation(fig, 13, alt, update, [FRAMES * [more], FRAMES * ["the least torque"]], -1)


def camera_that_jolts() -> Animation:
    """Lesson 14: geodesics join four orientations of a camera, and its angular velocity jumps.

    The number is the largest jump.
    """
    times, t = np.array([0.0, 1, 2, 4]), 4 * T  # s
    R = rb.matrix_from_zyx(np.radians([[-60, 0, 0], [-10, 40, 0], [50, -40, 30], [90, 20, 0]]))
    curve = rb.chain(times, R, leg=rb.geodesic)
    w = curve(t, 1)
    jump = np.linalg.norm(np.diff(curve([0.5, 1.5, 3], 1), axis=0), axis=1).max()
    alt = f"A camera jolts at each mark: its angular velocity jumps by up to {jump:.1f} rad/s."
    with _panels("space", "rectilinear") as (fig, (space, ax)):
        turn = _cameras([space], {"": curve(t)}, np.full((FRAMES, 3), np.nan))
        lines = [ax.plot([], [], color=COLOURS[x])[0] for x in "xyz"]
        ax.set(xlim=(0, 4), ylim=(-1.2, 1.7), xlabel="time (s)", title="angular velocity (rad/s)")

        def update(i: int) -> list[Any]:
            for line, x in zip(lines, w.T, strict=True):
                line.set_data(t[: i + 1], x[: i + 1])
            return [*turn(i), *lines]

        notes = [FRAMES * [f"jumps by up to {jump:.1f} rad/s"]]
        return _animation(fig, 14, alt, update, notes, -1, seconds=4.0)


def tool_at_one_rate() -> Animation:
    """Lesson 15: a tool has the same rate on the whole path, or the fastest rate at each place.

    The number is the ratio of the times.
    """
    stops = [[0, 0, 0, 0, 0, 0], [0, 0, 0, 1, 0, 0], [0, 0, 2, 1, 1, 0], [0, 0, 2, 0, 1, 0], [0, 0, 2, -1, 1, 0]]
    limits = {"angular_speed": 2, "speed": 3, "angular_acceleration": 4.8, "acceleration": 8}
    path = rb.projected_spline(np.arange(5.0), rb.pose_from_coordinates(stops))
    used = rb.limits_used(path, **limits)
    even = 4 * max(x if name.endswith("speed") else x**0.5 for name, (x, _) in used.items())
    timed = rb.fastest(path, **limits)
    fast = timed.domain[1]
    t = even * T
    motions = {"one rate": path(4 * T), "the fastest": timed(np.minimum(t, fast))}
    times = f"{even / fast:.1f} times as long"
    with _panels("space", "space") as (fig, axes):
        move = bodies.moving_boxes(axes, motions, np.array([0.6, 0.4, 0.2]))
        notes = [_said("{:.1f} s", t), _said("{:.1f} s", np.minimum(t, fast))]
        alt = f"A tool that moves at one rate takes {times} as with the fastest timing."
        return _animation(fig, 15, alt, move, notes, int((t > fast).argmax()), seconds=even)


def gripper_that_shakes() -> Animation:
    """Lesson 16: a gripper repeats all measured poses of a hand, and its acceleration is noise.

    The number is the error of the angular acceleration (root mean square).
    """
    hand, rng = lesson16.hand(), np.random.default_rng(16)
    times, t = np.linspace(0, 4, 401), 4 * T
    measured = hand(times) @ rb.exp_so3(rng.normal(scale=0.01, size=(401, 3)))
    fine = np.linspace(0, 4, 801)
    spline = rb.projected_spline(times, measured)
    a, needed = spline(fine, 2), hand(fine, 2)
    wrong = np.sqrt(np.mean(np.sum((a - needed) ** 2, axis=1)))
    most = np.linalg.norm(needed, axis=1).max()
    alt = f"{wrong:.0f} {most:.1f}"
    with _panels("space", "rectilinear") as (fig, (space, ax)):
        turn = bodies.moving_boxes([space], {"": _placed(spline(t))}, _GRIPPER)
        line = ax.plot([], [], color=COLOURS["path"], lw=1)[0]
        ax.set(xlim=(0, 4), ylim=(0, 2000), xlabel="time (s)", title="angular acceleration (rad/s²)")

        def update(i: int) -> list[Any]:
            n = 1 + 800 * i // (FRAMES - 1)
            line.set_data(fine[:n], np.linalg.norm(a[:n], axis=1))
            return [*turn(i), line]

        return _animation(fig, 16, alt, update, [FRAMES * [alt]], -1, seconds=4.0)


def camera_that_turns_back() -> Animation:
    """Lesson 17: a camera turns back, since its yaw is read in (−180°, 180°] and blended.

    The number is the angle by which it turns back.
    """
    times, t = np.array([0.0, 3, 5, 9]), 9 * T  # s
    marks = np.array([[0.0, 0, 0], [50, -10, 15], [140, 5, 20], [230, 0, 0]])
    R = rb.matrix_from_zyx(np.radians(marks))
    read = rb.zyx_from_matrix(R)
    blend = np.stack([np.interp(t, times, x) for x in read.T], axis=-1)
    right = rb.projected_spline(times, R, "rest")(t)
    back = np.degrees(read[3, 0] - read[2, 0])
    alt = f"A camera turns by {back:.0f}°"
    with _panels("space", "space") as (fig, axes):
        motions = {WRONG: rb.matrix_from_zyx(blend), RIGHT: right}
        move = _cameras(axes, motions, np.full((FRAMES, 3), np.nan))
        yaw = [np.degrees(blend[:, 0]), np.degrees(np.unwrap(rb.zyx_from_matrix(right)[:, 0]))]
        return _animation(fig, 17, alt, move, [_said("yaw {:.0f}°", x) for x in yaw], 38)


OPENINGS: list[Callable[[], Animation]] = [
    gripper_that_flips,
    car_that_slides,
    hand_that_hits_a_glass,
    camera_that_loses_its_target,
    box_that_grows,
    spray_robot,
    box_that_shrinks,
    wrench_that_leaves_its_bolt,
    book_that_turns_over,
    turn_that_snaps,
    cube_that_comes_from_another_side,
    turn_that_goes_back,
    solver_that_stops_at_a_local_minimum,
    book_taken_for_a_ball,
    camera_that_jolts,
    tool_at_one_rate,
    gripper_that_shakes,
    camera_that_turns_back,
]
"""The function of each lesson, by its number."""
