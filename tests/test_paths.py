"""Test curves of any duration, and chains; compare each leg with the curve of its two poses."""

import re
from functools import partial
from inspect import signature

import numpy as np
import oracles
import pytest

import rbcourse as rb
from rbcourse.curves.rigid import RigidMotion, rigid_motion

EPS = np.finfo(float).eps
RNG = np.random.default_rng(110)
N = 9
TIMES = -2 + np.cumsum(RNG.uniform(0.3, 1.7, N))
ROTATIONS = np.array([oracles.exp_so3(w) for w in RNG.normal(size=(N, 3))])
POSES = rb.pose_from_components(ROTATIONS, RNG.normal(size=(N, 3)))
TWISTS = RNG.normal(size=(N, 6))
H = np.diff(TIMES)

WITHOUT_VELOCITIES = [rb.geodesic, rb.projected_line, rb.geodesic, rb.screw]
WITH_VELOCITIES = [
    *rb.closed_forms.FORMS.values(),
    rb.minimum_acceleration,
    rb.projected_cubic,
    rb.minimum_acceleration,
]
LEGS = [*WITHOUT_VELOCITIES, *WITH_VELOCITIES, rb.projected_quintic]
every_leg = pytest.mark.parametrize("leg", LEGS, ids=lambda leg: leg.__name__)
both_groups = pytest.mark.parametrize("poses", [ROTATIONS, POSES], ids=["3", "4"])
V = np.hstack([TWISTS[:, :3], np.einsum("nij,nj->ni", ROTATIONS, TWISTS[:, 3:])])
ENDS = {"R0": ROTATIONS[:-1], "R1": ROTATIONS[1:], "A0": POSES[:-1], "A1": POSES[1:]}
for k, rates in enumerate((V[:-1] * H[:, None], V[1:] * H[:, None])):
    ENDS |= {f"w{k}": rates[:, :3], f"d{k}_dot": rates[:, 3:]}


def own_poses(leg):
    return POSES if leg.__name__.endswith("se3") else ROTATIONS


@every_leg
@both_groups
def test_a_chain_meets_its_poses(leg, poses):
    """The chain neither changes its arguments nor reads them later."""
    poses = POSES if own_poses(leg) is POSES else poses
    given = [TIMES.copy(), poses.copy(), TWISTS[:, : 3 if poses is ROTATIONS else 6].copy()]
    if leg in WITHOUT_VELOCITIES:
        given.pop()
    if leg is rb.projected_quintic:
        given[2] = rb.bessel_velocities(TIMES, poses)
    velocities = given[2].copy() if given[2:] else None
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
    smooth = {rb.projected_quintic: 2}.get(leg, int(velocities is not None))
    inner = TIMES[1:-1]
    for order in range(3):
        jumps = c(inner, order) - c(np.nextafter(inner, -9), order)
        assert np.abs(jumps - c.jumps(order)).max() < 1e-12
        assert (np.abs(jumps).max() < 1e-12) == (order <= smooth) or velocities is None
        values = c(many, order)
        size = 1 + np.abs(values).max()
        assert np.abs(values[::500] - c(many[::500], order)).max() < 1e-13 * size
    if velocities is None:
        assert np.abs(c.jumps(1)).max() > 0.1
    else:
        assert np.abs(c(TIMES, 1) - velocities).max() < 400 * EPS
        assert np.array_equal(c.velocities, velocities)
    needed = [one.name for one in signature(leg).parameters.values() if one.default is one.empty]
    if poses is own_poses(leg) and set(needed) <= set(ENDS):
        one = leg(**{name: ENDS[name] for name in needed})
        t = TIMES[:-1] + np.linspace(0, 1, 12)[:-1, None] * H
        for order, tolerance in enumerate((60, 400, 4000)):
            values = c(t, order).swapaxes(1, -1) * H**order
            want = one.at_own_times((t - TIMES[:-1]) / H, order).swapaxes(1, -1)
            assert np.abs(values - want).max() < tolerance * EPS


@every_leg
def test_a_chain_rests_where_this_is_requested(leg):
    """Between two rests at the same pose, the curve stands still."""
    poses = own_poses(leg)[[0, 1, 2, 2, 3]]
    if leg in WITHOUT_VELOCITIES:
        with pytest.raises(ValueError, match="rest_at: the legs take no velocities"):
            rb.chain(range(5), poses, leg=leg, rest_at=[2])
        assert np.abs(rb.chain(range(5), poses, leg=leg)([2.1, 2.5, 2.9], 1)).max() < 1e-13
        return
    for rest_at in ([2, 3], np.array([3, -3]), "repeated"):
        c = rb.chain(range(5), poses, leg=leg, rest_at=rest_at)
        resting = np.abs(c(range(5), 1)).max(axis=1) < 100 * EPS
        assert resting.tolist() == [True, False, True, True, True]
        assert np.abs(c([2.1, 2.5, 2.9]) - poses[2]).max() < 40 * EPS
        assert np.abs(c([2.1, 2.5, 2.9], 1)).max() < 1e-13
    one = rb.chain(range(5), own_poses(leg)[:5], leg=leg, rest_at=[2])
    resting = np.abs(one(range(5), 1)).max(axis=1) < 100 * EPS
    assert resting.tolist() == [True, False, True, False, True]


@both_groups
def test_a_repeated_pose_is_an_ordinary_pose(poses):
    """The curve depends continuously on the poses, and its acceleration is continuous."""
    poses = poses[[0, 1, 2, 2, 3]]
    other = poses.copy()
    other[3, :3, :3] @= oracles.exp_so3([1e-9, 0, 0])
    c, near = rb.chain(range(5), poses), rb.chain(range(5), other)
    assert np.abs(c.velocities - near.velocities).max() < 1e-7
    assert np.abs(c.jumps(2)).max() < 1e-12
    assert rb.acceleration_cost(c) == pytest.approx(rb.acceleration_cost(near), rel=1e-7)


@pytest.mark.parametrize("rest_at", ["pauses", [9], [-10], [1.0], 3, [[1]]])
def test_a_wrong_request_for_a_rest_is_refused(rest_at):
    with pytest.raises(ValueError, match="rest_at: indices"):
        rb.chain(TIMES, POSES, rest_at=rest_at)
    with pytest.raises(ValueError, match="rest_at: the velocities are given"):
        rb.chain(TIMES, POSES, TWISTS, rest_at=[1])


@pytest.mark.parametrize("ratio", [1, 100, 1e4])
def test_uneven_time_steps_lose_no_digits(ratio):
    """At poses and joints, w and w' are accurate to a few eps, relative to ‖w‖ and ‖w‖² + ‖w'‖.

    The reference has 60 digits. The bound is the rounding error of M divided by the sum of its two
    smallest eigenvalues.
    """
    steps = np.array([ratio, 1, ratio, ratio, 1, 1, 1, ratio])
    times = np.append(0, np.cumsum(steps))
    for leg, smooth in ((rb.projected_cubic, 1), (rb.projected_quintic, 2)):
        c = rb.chain(times, POSES, leg=leg)
        assert np.abs(c(times) - POSES).max() < 8 * EPS
        assert np.abs(c.legs.at_own_times(steps) - POSES[1:]).max() < 8 * EPS
        speed = np.abs(c(times, 1)).max()
        scales = 1, speed, speed**2 + np.abs(c(times, 2)).max()
        for order in range(smooth + 1):
            assert np.abs(c.jumps(order)).max() < 20 * EPS * scales[order]
    times = np.append(0, np.cumsum([1, ratio, 1, ratio, ratio, 1, 1, ratio]))
    legs = rb.chain(times, ROTATIONS, leg=rb.projected_quintic).legs
    for i, share in zip(range(N - 1), [1e-9, 0.2, 0.5, 0.8, 1 - 1e-9, 0.3, 0.6, 0.9], strict=True):
        M = oracles.polynomial_through(legs.ends[i], share)
        R = oracles.nearest_rotation(M)
        gap = oracles.two_smallest_eigenvalues(R.T @ M)
        size = np.abs(legs.ends[i]).max()
        assert np.abs(legs[i](share * legs.duration[i]) - R).max() < 8 * EPS * max(1, size / gap)


@both_groups
def test_a_chain_without_velocities_rests_at_its_ends(poses):
    """The accelerations of the chain are continuous, and equal to those of a chain of quintics."""
    rest = np.zeros(3 if poses is ROTATIONS else 6)
    c, chosen = rb.chain(TIMES, poses), rb.spline_velocities(TIMES, poses, (rest, rest))
    assert np.abs(c(TIMES, 1) - chosen).max() < 400 * EPS
    assert np.abs(c.jumps(2)).max() < 1e-12
    assert not c.velocities[[0, -1]].any()
    quintic = rb.chain(TIMES, poses, leg=rb.projected_quintic)
    assert np.abs(quintic(TIMES[1:-1], 2) - c(TIMES[1:-1], 2)).max() < 1e-12
    assert np.abs(quintic(TIMES[[0, -1]], 2)).max() < 1e-12


def test_user_defined_functions_make_legs():
    """A leg's function may be a `partial`, or combine one rotation with many paths of the origin.

    A function that takes an acceleration gets a quintic for the origin; other functions get a
    cubic.
    """
    t = np.linspace(*TIMES[[0, -1]], 50)
    for same, turn in (
        (rb.projected_quintic, lambda R0, R1, a1, **T: rb.geodesic(R0, R1, **T)),
        (rb.projected_cubic, lambda R0, R1, w0, **T: rb.geodesic(R0, R1, **T)),
    ):
        path, want = (rb.chain(TIMES, POSES, leg=leg)(t)[:, :3, 3] for leg in (turn, same))
        assert np.abs(path - want).max() < 1e-13

    def slow(R0, R1, duration=1):
        rest = np.zeros(3)
        return rb.closed_forms.exponential_cubic(R0, R1, rest, rest, duration=duration)

    def sliding(A0, A1, duration):
        turn = rb.geodesic(np.eye(3), np.eye(3), duration=duration)
        return rigid_motion(RigidMotion, turn, A0[:, :3, 3], A1[:, :3, 3])

    c = rb.chain(TIMES, POSES, leg=slow)
    assert np.abs(c(TIMES[:-1], 1)[:, :3]).max() < 20 * EPS  # the rotation rests at each pose
    assert np.abs(c(TIMES[2] + 0.3 * H[2])[:3, :3] - slow(*ROTATIONS[2:4])(0.3)).max() < 40 * EPS
    frozen = partial(rb.projected_line, f=lambda t, k: [t, 1 + 0 * t][k])
    assert np.abs(rb.chain(TIMES, ROTATIONS, leg=frozen)(TIMES) - ROTATIONS).max() < 20 * EPS
    places = rb.pose_from_components(np.eye(3), POSES[:, :3, 3])
    c, other = (rb.chain(TIMES, places, leg=leg) for leg in (sliding, rb.geodesic))
    for order in range(3):
        assert np.abs(c(t, order) - other(t, order)).max() < 1e-12


FAR = rb.pose_from_components(ROTATIONS, POSES[:, :3, 3] + [5e5, 5.3e6, 100])
HALF_TURN = ROTATIONS[:1] @ [np.eye(3), np.diag([1.0, -1, -1])]
TURNS = partial(rb.geodesic, ROTATIONS[:2], ROTATIONS[1:3])
MOVES = partial(rb.geodesic, POSES[:2], POSES[1:3])
GIVEN = "R0, R1, w0, w1, a0, a1"


def turned_by(w):
    return lambda R0, R1, **T: rb.geodesic(R0, R1 @ rb.exp_so3(w), **T)


@pytest.mark.parametrize(
    ("poses", "leg", "message"),
    [
        (ROTATIONS, rb.geodesic, f"it needs A0, which is not among {GIVEN}; use functools"),
        (POSES, rb.minimum_torque, f"it needs inertia, which is not among {GIVEN}, A0"),
        (ROTATIONS, rb.exp_so3, "it has no parameter duration: <function exp_so3"),
        (ROTATIONS, 3, "a function that makes curves is wanted, got 3"),
        (ROTATIONS, lambda R0, duration: None, "a stack of 2 curves of these durations is wanted"),
        (ROTATIONS, lambda duration: TURNS(duration=9), "a stack of 2 curves of these durations"),
        (ROTATIONS, turned_by([[0] * 3, [0, 1, 0]]), "it does not lead from poses[1] to poses[2]"),
        (FAR, turned_by([0, 0, 2e-6]), "it does not lead from poses[0] to poses[1]"),
        (POSES, lambda A0, **T: TURNS(**T), "curves of shape (4, 4) are wanted, got (3, 3)"),
        (POSES, lambda R0, **T: MOVES(**T), "curves of shape (3, 3) are wanted, got (4, 4)"),
        (
            ROTATIONS,
            lambda w0, **T: rb.closed_forms.bezier(*HALF_TURN, w0 + 9, w0, **T),
            "w0[0]: a norm",
        ),
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
OF_PATHS = rb.chain, rb.bessel_velocities, rb.spline_velocities
SCREWS = partial(rb.chain, leg=rb.screw)
LATE = rb.chain([1e9, 2e9], ROTATIONS[:2])
UNEVEN = rb.retime(rb.geodesic(ROTATIONS[:-1], ROTATIONS[1:]), H)


@pytest.mark.parametrize(
    ("function", "arguments", "message"),
    [
        *((function, *path) for function in OF_PATHS for path in PATHS),
        (rb.chain, ([0, 1], POSES[:2], TWISTS[:2, :3]), "velocities: shape (N, 6) is wanted"),
        (rb.chain, ([0, 1], POSES[:2], TWISTS[:3]), "velocities: 2 are wanted, one for each pose"),
        (SCREWS, (TIMES, POSES, TWISTS), "velocities: the legs take no"),
        (LATE, (3.5,), "t is 3.5, a time in [1000000000, 2000000000] is"),
        (UNEVEN.at_own_times, ([0 * H, 9 * np.eye(N - 1)[2]],), "t[1, 2] is 9.0, a time in [0, "),
        (rb.retime, (np.sin, 1), "curve: a Curve is wanted, got"),
        (rb.retime, (UNEVEN[0], 0), "duration is 0.0, a duration from 1e-100"),
        (rb.retime, (UNEVEN[0], [1, 2]), "duration: a single number or shape"),
        (rb.retime, (LATE, 1e-9), "duration is 1e-09: it vanishes by rounding when added"),
    ],
)
def test_bad_paths_and_durations_are_refused(function, arguments, message):
    with pytest.raises(ValueError, match=f"^{re.escape(message)}"):
        function(*arguments)


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
    c = rb.chain(TIMES, POSES)
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
    again = rb.retime(rb.chain(1.3e9 + TIMES, ROTATIONS), 1e-3)  # the times are seconds since 1970
    assert np.abs(again.legs.duration / H * np.ptp(TIMES) / 1e-3 - 1).max() < 1e-5
    assert np.abs(again(again.domain) - ROTATIONS[[0, -1]]).max() < 1e-12
    assert rb.retime(rb.chain([0, 1e50], POSES[:2]), 1e-40).domain == (0, 1e-40)


def test_the_cost_of_a_chain_whose_velocity_jumps_raises_an_error():
    """In the second chain only the angular velocity jumps. The jump is small, and the motion is
    fast."""

    def uneven(R0, R1, w0, w1, duration):
        return rb.projected_cubic(R0, R1, w0 * (1 + 1e-6), w1, duration=duration)

    fast = rb.pose_from_components(ROTATIONS, 1e6 * POSES[:, :3, 3])
    for poses, leg in ((POSES, rb.geodesic), (fast, uneven)):
        with pytest.raises(RuntimeError, match=r"^acceleration cost: a velocity jumps at a joint"):
            rb.acceleration_cost(rb.chain(TIMES, poses, leg=leg))
    assert rb.acceleration_cost(rb.chain([0, 9], POSES[:2], leg=rb.geodesic)) == 0
    stops = rb.chain(TIMES, POSES, 0 * TWISTS, leg=rb.minimum_acceleration)
    assert 0 < rb.acceleration_cost(stops) < np.inf


def test_moving_a_chain_far_from_the_origin_keeps_the_motion():
    """A slow motion, sampled at 1 kHz and 5300 km from the origin, has no rests and no jumps."""
    t = np.arange(60) / 1000
    here = rb.pose_from_coordinates(t[:, None] * [0, 0, 4e-3, 4e-3, 0, 0])
    far = here.copy()
    far[:, :3, 3] += [5e5, 5.3e6, 100]
    c, other = rb.chain(t, far), rb.chain(t, here)
    assert np.abs(c.velocities[10:-10, [2, 3]] / 4e-3 - 1).max() < 1e-3
    assert np.abs(c.velocities - other.velocities).max() < 1e-5
    assert np.abs(c.jumps(1)).max() < 1e-12
    turning, same = (rb.acceleration_cost_parts(one)[0] for one in (c, other))
    assert turning == pytest.approx(same, rel=1e-9)
    far = POSES[:3].copy()
    far[:, :3, 3] *= 1e11
    assert np.abs(rb.chain(range(3), far)(1)[:3, 3] / far[1, :3, 3] - 1).max() < 1e-15


def test_small_turns_and_turns_near_a_half_turn_are_accurate():
    near_half_turn = np.pi + 1e-6 - 1e-5
    R = rb.exp_so3(np.outer([0, 1e-6, 2e-6, near_half_turn], [0, 0, 1]))
    assert np.abs(rb.chain(range(3), R[:3]).velocities[1] - [0, 0, 1.5e-6]).max() < 1e-12
    assert np.abs(rb.log_so3(rb.chain([0, 1], R[1::2])(0.5)) - [0, 0, np.pi / 2]).max() < 1e-4


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
