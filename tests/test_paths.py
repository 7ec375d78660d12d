"""Test curves of any duration, and chains; compare each leg with the curve of its two poses."""

import re
from functools import partial

import numpy as np
import oracles
import pytest
from scipy.interpolate import CubicHermiteSpline, CubicSpline, make_interp_spline

import rbcourse as rb

EPS = np.finfo(float).eps
RNG = np.random.default_rng(110)
N = 9
TIMES = -2 + np.cumsum(RNG.uniform(0.3, 1.7, N))
ROTATIONS = np.array([oracles.exp_so3(w) for w in RNG.normal(size=(N, 3))])
POSES = rb.pose_from_components(ROTATIONS, RNG.normal(size=(N, 3)))
TWISTS, BENDS = RNG.normal(size=(2, N, 6))
H = np.diff(TIMES)

WITHOUT_VELOCITIES = [rb.geodesic, rb.projected_line, rb.screw]
CUBICS = [rb.projected_cubic, rb.closed_forms.quaternion_cubic]
LEGS = [*WITHOUT_VELOCITIES, *CUBICS, rb.minimum_acceleration, rb.projected_quintic]
both_groups = pytest.mark.parametrize("poses", [ROTATIONS, POSES], ids=["3", "4"])


def quintics(spline):
    """Return the chain of quintics with the velocities and accelerations of a spline."""
    return rb.chain(spline.times, *spline.state(spline.times))


def resting(times, poses, **given):
    return rb.projected_spline(times, poses, "rest", **given)


@pytest.mark.parametrize("leg", LEGS, ids=lambda leg: leg.__name__)
@both_groups
def test_a_chain_meets_its_poses(leg, poses):
    """The chain neither changes its arguments nor reads them later."""
    if leg is rb.screw and poses is ROTATIONS:
        with pytest.raises(ValueError, match=r"^leg: start, goal: poses"):
            rb.chain(TIMES, poses, leg=leg)
        return
    smooth = -1 if leg in WITHOUT_VELOCITIES else 1 + (leg is rb.projected_quintic)
    right = (
        poses,
        *(x[:, : 3 if poses is ROTATIONS else 6] for x in (TWISTS, BENDS)[: max(0, smooth)]),
    )
    given = [TIMES.copy(), *(x.copy() for x in right)]
    for array in given:
        array.flags.writeable = False
    c = rb.chain(*given, leg=leg)
    for array in given:
        array.flags.writeable = True
        array.fill(0)
    assert c.domain == (TIMES[0], TIMES[-1])
    assert np.abs(c(TIMES) - poses).max() < 60 * EPS
    assert np.abs(c(np.nextafter(TIMES[1:], -9)) - poses[1:]).max() < 200 * EPS
    assert np.abs(c.jumps(0)).max() < 200 * EPS
    assert c([], 1).shape == (0, 3 * c.size - 6)
    many = RNG.uniform(*c.domain, size=5000)  # these times fill more than one block
    inner = TIMES[1:-1]
    for order in range(3):
        jumps = c(inner, order) - c(np.nextafter(inner, -9), order)
        values = c(many, order)
        size = 1 + np.abs(values).max()
        assert np.abs(jumps - c.jumps(order)).max() < 1e-12 * size
        assert (np.abs(jumps).max() < 1e-12 * size) == (order <= smooth) or smooth < 0
        assert np.abs(values[::500] - c(many[::500], order)).max() < 1e-13 * size
    for order, rates in enumerate(right[1:], 1):
        assert np.abs(c(TIMES, order) - rates).max() < 4000 * EPS
    if smooth < 0:
        assert np.abs(c.jumps(1)).max() > 0.1
        assert c.velocities is None
    else:
        assert np.array_equal(c.velocities, right[1])
    scales = [H.reshape(-1, *[1] * (x.ndim - 1)) ** k for k, x in enumerate(right)]
    ends = [x for y, h in zip(right, scales, strict=True) for x in (h * y[:-1], h * y[1:])]
    one = leg(*ends)
    t = TIMES[:-1] + np.linspace(0, 1, 12)[:-1, None] * H
    for order, tolerance in enumerate((60, 400, 4000)):
        values = c(t, order).swapaxes(1, -1) * H**order
        want = one.at_own_times((t - TIMES[:-1]) / H, order).swapaxes(1, -1)
        assert np.abs(values - want).max() < tolerance * EPS * (1 + np.abs(want).max())
    for time in (*TIMES, *t[3]):
        for order, found in enumerate(c.state(time)):
            want = c([time], order)[0]
            assert np.abs(found - want).max() < 200 * EPS * (1 + np.abs(want).max())
            assert np.array_equal(c(time, order), found)


@both_groups
def test_a_spline_rests_where_this_is_requested(poses):
    """Between two rests at the same pose, the curve stands still."""
    repeated = poses[[0, 1, 2, 2, 3]]
    for rest_at in ([2, 3], np.array([3, -3])):
        c = resting(range(5), repeated, rest_at=rest_at)
        still = np.abs(c(range(5), 1)).max(axis=1) < 100 * EPS
        assert still.tolist() == [True, False, True, True, True]
        assert np.abs(c([2.1, 2.5, 2.9]) - repeated[2]).max() < 40 * EPS
        assert np.abs(c([2.1, 2.5, 2.9], 1)).max() < 1e-13
    one = rb.projected_spline(range(5), poses[:5], rest_at=[2])  # the ends are natural
    still = np.abs(one(range(5), 1)).max(axis=1) < 100 * EPS
    assert still.tolist() == [False, False, True, False, False]


@both_groups
def test_a_repeated_pose_is_an_ordinary_pose(poses):
    """The curve depends continuously on the poses, and its acceleration is continuous."""
    poses = poses[[0, 1, 2, 2, 3]]
    other = poses.copy()
    other[3, :3, :3] @= oracles.exp_so3([1e-9, 0, 0])
    c, near = resting(range(5), poses), resting(range(5), other)
    assert np.abs(c.velocities - near.velocities).max() < 1e-7
    assert np.abs(c.jumps(2)).max() < 1e-12
    assert rb.acceleration_cost(c) == pytest.approx(rb.acceleration_cost(near), rel=1e-7)


@pytest.mark.parametrize("rest_at", ["pauses", [9], [-10], [1.0], 3, [[1]], [False, True]])
def test_a_wrong_request_for_a_rest_is_refused(rest_at):
    with pytest.raises(ValueError, match="rest_at: indices"):
        rb.projected_spline(TIMES, POSES, rest_at=rest_at)


@pytest.mark.parametrize("ratio", [1, 1e4])
def test_uneven_time_steps_lose_no_digits(ratio):
    """At poses and joints, w and w' are accurate to a few eps, relative to ‖w‖ and ‖w‖² + ‖w'‖.

    The reference has 60 digits. The bound is the rounding error of M divided by the sum of its two
    smallest eigenvalues.
    """
    steps = np.array([ratio, 1, ratio, ratio, 1, 1, 1, ratio])
    times = np.append(0, np.cumsum(steps))
    spline = resting(times, POSES)
    for c, smooth in ((spline, 1), (quintics(spline), 2)):
        assert np.abs(c(times) - POSES).max() < 8 * EPS
        assert np.abs(c.legs.at_own_times(steps) - POSES[1:]).max() < 8 * EPS
        speed = np.abs(c(times, 1)).max()
        scales = 1, speed, speed**2 + np.abs(c(times, 2)).max()
        for order in range(smooth + 1):
            assert np.abs(c.jumps(order)).max() < 20 * EPS * scales[order]
    times = np.append(0, np.cumsum([1, ratio, 1, ratio, ratio, 1, 1, ratio]))
    legs = quintics(resting(times, ROTATIONS)).legs
    for i, share in zip(range(N - 1), [1e-9, 0.2, 0.5, 0.8, 1 - 1e-9, 0.3, 0.6, 0.9], strict=True):
        M = oracles.polynomial_through(legs.ends[i], share)
        R = oracles.nearest_rotation(M)
        gap = oracles.two_smallest_eigenvalues(R.T @ M)
        size = np.abs(legs.ends[i]).max()
        assert np.abs(legs[i](share * legs.duration[i]) - R).max() < 8 * EPS * max(1, size / gap)


@both_groups
def test_a_spline_with_rests_rests_at_its_ends(poses):
    """The accelerations of the chain are continuous, and equal to those of a chain of quintics."""
    rest = np.zeros(3 if poses is ROTATIONS else 6)
    c, chosen = resting(TIMES, poses), rb.spline_velocities(TIMES, poses, (rest, rest))
    assert np.array_equal(c.velocities, rb.spline_velocities(TIMES, poses, "rest"))
    assert np.abs(c(TIMES, 1) - chosen).max() < 400 * EPS
    assert np.abs(c.jumps(2)).max() < 1e-12
    assert not c.velocities[[0, -1]].any()
    for make in (rb.quaternion_spline, rb.minimum_acceleration_spline):
        assert np.abs(make(TIMES, poses, "rest")(TIMES[[0, -1]], 1)).max() < 400 * EPS
    quintic = quintics(c)
    assert np.abs(quintic(TIMES, 2) - c(TIMES, 2)).max() < 1e-11


def test_user_defined_functions_make_legs():
    """A leg's function may be a `partial`, and may or may not take velocities."""

    def slow(start, goal, duration=1):
        return rb.closed_forms.exponential_cubic(start, goal, duration=duration)

    c = rb.chain(TIMES, POSES, leg=slow)
    assert np.abs(c(TIMES[:-1], 1)).max() < 20 * EPS  # the body rests at each pose
    assert np.abs(c(TIMES[2] + 0.3 * H[2]) - slow(*POSES[2:4])(0.3)).max() < 40 * EPS
    frozen = partial(rb.projected_line, f=lambda t, k: [t, 1 + 0 * t][k])
    assert np.abs(rb.chain(TIMES, ROTATIONS, leg=frozen)(TIMES) - ROTATIONS).max() < 20 * EPS
    body = rb.Body(np.diag([1, 2, 2.5]), 3, [1, 2, 3])
    heavy = rb.chain(TIMES, POSES, TWISTS, leg=partial(rb.projected_cubic, body=body))
    assert repr(heavy.body) == repr(body)


FAR = rb.pose_from_components(ROTATIONS, POSES[:, :3, 3] + [5e5, 5.3e6, 100])
HALF_TURN = ROTATIONS[:1] @ [np.eye(3), np.diag([1.0, -1, -1])]
TURNS = partial(rb.geodesic, ROTATIONS[:2], ROTATIONS[1:3])
heavy = partial(rb.projected_cubic, body=rb.Body(np.stack([np.eye(3), 2 * np.eye(3)])))


def turned_by(w):
    turn = rb.pose_from_components(rb.exp_so3(w), [0, 0, 0])
    return lambda start, goal, **T: rb.geodesic(
        start, goal @ turn[..., : goal.shape[-1], : goal.shape[-1]], **T
    )


def slow_turns(start, goal, duration):
    return TURNS(duration=9)


@pytest.mark.parametrize(
    ("poses", "leg", "message"),
    [
        (ROTATIONS, rb.exp_so3, "a function that takes start, goal and the keyword duration is"),
        (ROTATIONS, 3, "a function that takes start, goal and the keyword duration is wanted (3"),
        (ROTATIONS, rb.screw, "start, goal: poses, shape (..., 4, 4), are wanted, got rotations"),
        (ROTATIONS, slow_turns, "a stack of 2 curves of these durations is wanted"),
        (ROTATIONS, turned_by([[0] * 3, [0, 1, 0]]), "it does not lead from poses[1] to poses[2]"),
        (FAR, turned_by([0, 0, 2e-6]), "it does not lead from poses[0] to poses[1]"),
        (POSES, lambda A, B, **T: TURNS(**T), "curves of shape (4, 4) are wanted, got (3, 3)"),
        (ROTATIONS, lambda A, B, **T: heavy(A, B, **T), "the same body for all legs is wanted"),
    ],
)
def test_functions_that_do_not_make_legs_are_refused(poses, leg, message):
    with pytest.raises(ValueError, match=f"^leg: {re.escape(message)}"):
        rb.chain([0, 1, 2], poses[:3], leg=leg)


PATHS = [
    (([0, 1, 1], ROTATIONS[:3]), "times[2] is 1.0, a time after 1.0 is wanted"),
    (([0, np.nan, 1], POSES[:3]), "times[1] is nan"),
    (([0, 1e-200], POSES[:2]), "times[0] and times[1] are 1e-200 apart: too close or too far"),
    (([-1.7e308, 1.7e308], POSES[:2]), "times[0] and times[1] are inf apart"),
    (([0], POSES[:1]), "times, poses: two or more are wanted, got 1"),
    (([0, 1], POSES[0]), "poses: shape (N, 4, 4) or (N, 3, 3) is wanted, got (4, 4)"),
    (([0, 1], [-np.eye(3)] * 2), "poses[0] is not a rotation: its determinant is −1"),
    (([0, 1], HALF_TURN), "poses[0] and poses[1] are a half-turn apart: put a pose"),
]
SCREWS = partial(rb.chain, leg=rb.screw)
LATE = resting([1e9, 2e9], ROTATIONS[:2])
UNEVEN = rb.geodesic(ROTATIONS[:-1], ROTATIONS[1:]).retimed(H)


@pytest.mark.parametrize(
    ("function", "arguments", "message"),
    [
        *((rb.bessel_velocities, *path) for path in PATHS),
        *((make, *PATHS[0]) for make in (resting, rb.spline_velocities)),
        (rb.chain, ([0, 1], POSES[:2], TWISTS[:2, :3]), "velocities: shape (N, 6) is wanted"),
        (rb.chain, ([0, 1], POSES[:2], TWISTS[:3]), "velocities: 2 are wanted, one for each pose"),
        (rb.chain, ([0, 1], POSES[:2]), "velocities: one for each pose is wanted; projected_spl"),
        (SCREWS, ([0, 1], POSES[:2], None, BENDS[:2]), "accelerations: not without velocities"),
        (rb.chain, ([0, 1], POSES[:2], TWISTS[:2], BENDS[:3]), "accelerations: shape (2, 6) is"),
        (SCREWS, (TIMES, POSES, TWISTS), "leg: a function that takes start, goal, v0, v1 and the"),
        (
            partial(rb.chain, leg=rb.projected_cubic),
            (TIMES, POSES, TWISTS, BENDS),
            "leg: a function that takes start, goal, v0, v1, a0",
        ),
        (LATE, (3.5,), "t is 3.5, a time in [1000000000, 2000000000] is"),
        (UNEVEN.at_own_times, ([0 * H, 9 * np.eye(N - 1)[2]],), "t[1, 2] is 9.0, a time in [0, "),
        (UNEVEN[0].retimed, (0,), "duration is 0.0, a duration from 1e-100"),
        (UNEVEN[0].retimed, ([1, 2],), "duration: a single number or shape"),
        (LATE.retimed, (1e-9,), "duration is 1e-09: it vanishes by rounding when added"),
        (rb.projected_spline, (TIMES, POSES, (TWISTS[0, :3], None)), "ends"),
        (UNEVEN[0].moved, (POSES[0],), "left: shape (3, 3) is wanted, since"),
        (UNEVEN[0].moved, (None, 2 * np.eye(3)), "right is not a rotation"),
        (LATE.moved, (ROTATIONS[:2],), "left: shape (3, 3) is wanted, since"),
    ],
)
def test_bad_paths_and_durations_are_refused(function, arguments, message):
    with pytest.raises(ValueError, match=f"^{re.escape(message)}"):
        function(*arguments)


GRIP = rb.Body(np.diag([0.2, 0.3, 0.4]), 2, [0.1, -0.2, 0.3])
FRAMES = rb.pose_from_coordinates([[0.3, -1, 2, 4, 5, -6], [1, 0.5, -0.4, 0.3, 0.2, 0.1]])
PATHS_OF = {
    "spline": partial(rb.projected_spline, body=GRIP),
    "quaternions": rb.quaternion_spline,
    "optimum": partial(rb.minimum_acceleration_spline, body=GRIP),
    "screws": lambda t, poses: rb.chain(t, poses, leg=rb.geodesic),
}


@pytest.mark.parametrize("name", PATHS_OF)
@both_groups
def test_a_chain_that_is_moved_is_a_chain_with_the_same_costs(name, poses):
    size = poses.shape[-1]
    c, (L, X) = PATHS_OF[name](TIMES, poses), FRAMES[:, :size, :size]
    other, t = c.moved(L, X), TIMES[:-1] + 0.3 * H
    assert other.domain == c.domain
    assert np.array_equal(other.times, TIMES)
    assert np.abs(other(t) - L @ c(t) @ X).max() < 1e-13
    rate = np.linalg.inv(other(t)) @ oracles.derivative_by_differences(other, t, 1e-3)
    assert np.abs(other(t, 1) - (rb.vee_so3 if size == 3 else rb.vee_se3)(rate)).max() < 1e-9
    slope = oracles.derivative_by_differences(lambda t: other(t, 1), t, 1e-3)
    assert np.abs(other.twist_rate(t) - slope).max() < 1e-8
    if c.velocities is not None:
        assert np.abs(other.velocities - other(TIMES, 1)).max() < 1e-12
        cost = rb.acceleration_cost(c)
        assert rb.acceleration_cost(other) == pytest.approx(cost, rel=1e-9)
    slow, back = other.retimed(2 * np.ptp(TIMES)), other.moved(np.linalg.inv(L), np.linalg.inv(X))
    for order in range(3):
        assert np.abs(slow(slow.times, order) * 2**order - other(TIMES, order)).max() < 1e-11
        assert np.abs(back(t, order) - c(t, order)).max() < 1e-11


@pytest.mark.parametrize(
    "turn",
    [
        rb.projected_spline(TIMES, ROTATIONS, body=GRIP),
        rb.minimum_acceleration_spline(TIMES, ROTATIONS),
        rb.projected_cubic(*ROTATIONS[:2], body=GRIP, duration=2),
    ],
)
def test_a_rotation_and_a_position_are_joined(turn):
    """The knots of the position are not those of the rotation."""
    (start, end), ball = turn.domain, rb.Body.ball()
    knots = start + (end - start) * np.array([0, 0.15, 0.6, 0.85, 1])
    path = CubicSpline(knots, POSES[:5, :3, 3])
    t = np.append(np.linspace(start, end, 24), knots)
    joined = rb.joined(turn, path)
    for c, k in ((joined, 1), (joined.retimed(3 * (end - start)), 3)):
        times = np.minimum(start + k * (t - start), c.domain[1])
        assert c.domain == pytest.approx((start, start + k * (end - start)))
        state, R = c.state(times), turn(t)
        assert np.abs(state.pose - rb.pose_from_components(R, path(t))).max() < 1e-12
        for order in (1, 2):
            v = (R.mT @ path(t, order)[..., None])[..., 0]
            want = np.hstack([turn(t, order), v]) / k**order
            assert np.abs(state[order] - want).max() < 1e-11
        for i in (0, 7, -1):
            for one, found in zip(c.state(times[i]), state, strict=True):
                assert np.abs(one - found[i]).max() < 1e-12
        if hasattr(turn, "times"):  # a chain remains a chain
            assert np.abs(c.velocities - c(c.times, 1)).max() < 1e-12
        assert c.body is turn.body
        rotation, translation = rb.acceleration_cost_parts(c, body=ball)
        want = rb.acceleration_cost(turn, body=ball) / k**3
        assert rotation == pytest.approx(want, rel=1e-9)
        a = path(knots, 2)
        squares = np.sum(a[:-1] ** 2 + a[:-1] * a[1:] + a[1:] ** 2, axis=1) / 3
        assert translation == pytest.approx(squares @ np.diff(knots) / k**3, rel=1e-9)


@pytest.mark.parametrize("shift", [0, 1.7e9])
def test_smooth_positions_that_rest_at_their_knots_are_joined(shift):
    """After 1970, neighbouring times differ by 2e-7 s, in which the velocity changes."""
    t = shift + np.array([0, 1, 2.5])
    turn = rb.projected_spline(t, ROTATIONS[:3], "rest", rest_at=[1])
    there = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0]])
    clamped = CubicSpline(t[[0, 1, 2]], there[[0, 1, 0]], bc_type="clamped")
    for path in (CubicHermiteSpline(t, there, 0 * there), clamped, CubicSpline(t, there)):
        assert np.abs(rb.joined(turn, path)(t)[:, :3, 3] - path(t)).max() < 1e-12
    with pytest.raises(ValueError, match=r"^position: its velocity jumps"):
        rb.joined(turn, make_interp_spline(t, there, k=1))


def corners(share):
    """Return straight lines with a corner in the middle of this share of the first leg."""
    t = share * H[0] * np.array([0, 0.5, 1])
    return make_interp_spline(t, [[0, 0, 0], [1, 0, 0], [1, 1, 0]], k=1)


@pytest.mark.parametrize(
    ("turn", "path", "message"),
    [
        (UNEVEN, np.sin, "rotation: a single curve on SO(3) is wanted, got "),
        (rb.geodesic(*POSES[:2]), np.sin, "rotation: a single curve on SO(3) is wanted, got "),
        (
            rb.fastest(LATE, angular_acceleration=1),
            np.sin,
            "rotation: it is a Timed; join its path",
        ),
        (UNEVEN[0], UNEVEN[0], "position: a callable position(t, order) is wanted, such as"),
        (UNEVEN[0], lambda t: np.zeros(3), "position: a callable position(t, order) is wanted"),
        (UNEVEN[0], corners(1), "position: its velocity jumps at t = "),
        (UNEVEN[0], corners(0.5), "position: its knots from 0.0 to "),
        (UNEVEN[0], lambda t, k: np.zeros(3), "position(t, 0): shape (1, 3) is wanted, got (3,)"),
        (UNEVEN[0], lambda t, k: np.full((1, 3), np.nan), "position(t, 0)[0, 0] is nan, a finite"),
    ],
)
def test_errors_name_the_part_that_cannot_be_joined(turn, path, message):
    with pytest.raises(ValueError, match=f"^{re.escape(message)}"):
        rb.joined(turn, path)(0)


def test_errors_name_the_leg():
    """With these velocities, the cubic M for a turn of 2 rad has rank 1 at half time."""
    turn = np.array([0, 0, 2.0])
    R = rb.exp_so3([[0, 0, 0], -turn / 2, turn / 2])
    w = -4 / np.tan(1) * np.array([[0, 0, 0], [0, 0, 1], [0, 0, 1]])
    with pytest.warns(RuntimeWarning, match=r"of curve \[1\]") as warned:
        c = rb.chain([0, 1, 2], R, w)
    assert warned[0].filename == __file__
    for t in (1.5, [0.2, 0.7, 1.5, 1.7], [1.7, 1.5]):
        with pytest.raises(ValueError, match=r"^leg 1, from 1\.0 to 2\.0, 0\.5 after its start:"):
            c(t)
    w = np.outer([0, 0, 1, 0], [1e160, 0, 0])  # the optimum is not found
    message = r"^leg: it found no curve from poses\[1\] to poses\[2\] \(NaN\)"
    with pytest.warns(RuntimeWarning), pytest.raises(ValueError, match=message):
        rb.chain(range(4), ROTATIONS[:4], w, leg=rb.minimum_acceleration)


@pytest.mark.parametrize("duration", [1e-9, 0.25, 3, 1e12])
def test_retiming_a_chain_scales_its_times_uniformly(duration):
    c = resting(TIMES, POSES)
    again, (first, last) = c.retimed(duration), c.domain
    start, end = again.domain
    assert (start, end) == (first, first + duration)
    rate = (last - first) / duration
    t = np.minimum(start + np.linspace(0, 1, 7) * (end - start), end)
    tolerance = 1e-9 + 20 * np.spacing(abs(start)) / duration  # the times are rounded
    for order in range(3):
        want = c(np.clip(first + (t - start) * rate, first, last), order) * rate**order
        assert np.abs(again(t, order) - want).max() <= tolerance * np.abs(want).max()
    assert np.abs(again([start, end]) - c([first, last])).max() < 60 * EPS
    again = resting(1.3e9 + TIMES, ROTATIONS).retimed(1e-3)  # the times are seconds since 1970
    assert np.abs(again.legs.duration / H * np.ptp(TIMES) / 1e-3 - 1).max() < 1e-5
    assert np.abs(again(again.domain) - ROTATIONS[[0, -1]]).max() < 1e-12
    assert resting([0, 1e50], POSES[:2]).retimed(1e-40).domain == (0, 1e-40)


def test_the_cost_of_a_chain_whose_velocity_jumps_raises_an_error():
    """In the second chain only the angular velocity jumps. The jump is small, and the motion is
    fast."""

    def uneven(start, goal, v0, v1, duration):
        scale = 1 + 1e-6 * (np.arange(6) < 3)
        return rb.projected_cubic(start, goal, v0 * scale, v1, duration=duration)

    fast = rb.pose_from_components(ROTATIONS, 1e6 * POSES[:, :3, 3])
    V = rb.spline_velocities(TIMES, fast)
    for c in (rb.chain(TIMES, POSES, leg=rb.geodesic), rb.chain(TIMES, fast, V, leg=uneven)):
        with pytest.raises(RuntimeError, match=r"^acceleration cost: a velocity jumps at a joint"):
            rb.acceleration_cost(c)
    assert rb.acceleration_cost(rb.chain([0, 9], POSES[:2], leg=rb.geodesic)) == 0
    stops = rb.chain(TIMES, POSES, 0 * TWISTS, leg=rb.minimum_acceleration)
    assert 0 < rb.acceleration_cost(stops) < np.inf


def test_moving_a_chain_far_from_the_origin_keeps_the_motion():
    """A slow motion, sampled at 1 kHz and 5300 km from the origin, has no rests and no jumps."""
    t = np.arange(60) / 1000
    here = rb.pose_from_coordinates(t[:, None] * [0, 0, 4e-3, 4e-3, 0, 0])
    far = here.copy()
    far[:, :3, 3] += [5e5, 5.3e6, 100]
    c, other = resting(t, far), resting(t, here)
    assert np.abs(c.velocities[10:-10, [2, 3]] / 4e-3 - 1).max() < 1e-3
    assert np.abs(c.velocities - other.velocities).max() < 1e-5
    assert np.abs(c.jumps(1)).max() < 1e-12
    turning, same = (rb.acceleration_cost_parts(one)[0] for one in (c, other))
    assert turning == pytest.approx(same, rel=1e-9)
    far = POSES[:3].copy()
    far[:, :3, 3] *= 1e11
    assert np.abs(resting(range(3), far)(1)[:3, 3] / far[1, :3, 3] - 1).max() < 1e-15


def test_small_turns_and_turns_near_a_half_turn_are_accurate():
    near_half_turn = np.pi + 1e-6 - 1e-5
    R = rb.exp_so3(np.outer([0, 1e-6, 2e-6, near_half_turn], [0, 0, 1]))
    assert np.abs(resting(range(3), R[:3]).velocities[1] - [0, 0, 1.5e-6]).max() < 1e-12
    assert np.abs(rb.log_so3(resting([0, 1], R[1::2])(0.5)) - [0, 0, np.pi / 2]).max() < 1e-4


def test_a_parabola_through_three_poses_has_bessels_velocities():
    """The curve R_i exp(x(t)), with a parabola x(t), passes through the neighbours of R_i. Another
    parabola passes through the positions."""
    chosen = rb.bessel_velocities(TIMES, POSES)
    for i in range(N):
        m = min(max(i, 1), N - 2)
        three = slice(m - 1, m + 2)
        x = [oracles.log_so3(ROTATIONS[m].T @ R) for R in ROTATIONS[three]]
        values = np.hstack([x, POSES[three, :3, 3]])
        _, slope, here = np.polyfit(TIMES[three] - TIMES[i], values, 2)
        w = oracles.right_jacobian_so3(here[:3]) @ slope[:3]
        assert np.abs(chosen[i, :3] - w).max() < 200 * EPS
        assert np.abs(chosen[i, 3:] - ROTATIONS[i].T @ slope[3:]).max() < 200 * EPS
    w = rb.bessel_velocities([1, 3], ROTATIONS[:2])  # between two poses, the velocity is constant
    assert np.abs(w - oracles.log_so3(ROTATIONS[0].T @ ROTATIONS[1]) / 2).max() < 10 * EPS
