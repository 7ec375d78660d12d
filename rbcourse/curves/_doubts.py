"""Warnings about recordings that are smoothed: gaps, wrong poses, and a doubtful noise."""

from __future__ import annotations

import warnings
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import ArrayLike

from rbcourse._numerics import Array
from rbcourse.curves.velocities import usual_step
from rbcourse.so3 import angle_between, exp_so3, log

if TYPE_CHECKING:
    from rbcourse.curves.smoothing import Smoother

GAP = 5.0  # usual steps; shorter steps are no gaps [the longest of 1,000 random ones: 3.4 to 8]
MANY_GAPS = 10  # more are not those of lost poses
SHORTEST = 0.1  # steps: shorter periods have another unit than the times, or pass through all poses
FEW = 10  # poses; with 4, cross validation took half of 60 motions for noise
WRONG = 10.0  # times the median error [noise alone: 5; a pose off by 20 times the noise: 12]
OFF_LINE = 5.0  # times the usual distance [noise alone: 3; three poses off by 50 times: 7]
ALIKE = 0.75  # of the largest distance: next to a wrong pose, half; next to a jump, all of it
BENT, KINK = 4.0, 10.0  # times the median distance [noise alone: 3.5; a wrong pose: next to it, 5]
MANY_KINKS, MOST_KINKS = 10, 0.8  # of poses, and the share of those that are not next to others
# Dependent noise: the period in steps is 4 to 5.8 [coefficients 0.5 to 0.9], and the step times
# (period/6)^4.5 is below 3 times the noise [independent noise, oscillations of 26 steps: 3.1]
LEAST_OF_SHORT, SHORT, SLOW, SMALL_TURN = 3.9, 6.0, 3.0, 0.1
NEAR = 10  # poses on each side; three quarters of them are within the usual distance
MOST_SLOPE = 0.75  # of the mean slope [rest for 3 of 20 poses, then steady: 0.7]
CLEAR = 5.0  # standard errors of the slope at an end [bodies at rest: 2.5]
STILL = 0.2  # of the largest usual step: a smaller one is that of a body at rest
MANY_HELD = 0.05  # of the poses
LONG_RUN, JUMP = 5, 3.0  # equal steps, and the step after them in usual largest steps
ROUNDING = 1e-9  # times the largest entry of the poses; smaller errors are those of rounding


def warn_of_doubts(
    smoother: Smoother,
    curve: Any,
    poses: Array,
    noise: ArrayLike | None,
    period: ArrayLike | None,
    weights: ArrayLike | None,
) -> None:
    """Warn of doubts about a smoothed curve; the arguments are those of `smoothing_spline`.

    Given weights may be those of a search for wrong poses, so there is no warning of them.
    """
    _check_gaps(smoother, curve.period)
    if period is not None:
        _check_period(smoother, curve.period)
    if smoother.pad:
        _check_rest(smoother, poses)
    if _check_held(smoother, poses):
        return
    if interpolated := _interpolated(smoother, poses):
        if period is None:
            _warn(interpolated, -1)
        return
    if weights is None and _check_neighbours(smoother, poses):
        return
    if period is None:
        _check_noise(smoother, curve.period, noise)
        _check_poses(smoother, curve, poses)
    if period is None and noise is None:
        _check_dependent(smoother, curve, poses)


def _warn(what: str, depth: int = 0) -> None:
    """Warn; the place is the call of `smoothing_spline`; `depth` counts calls within a check."""
    warnings.warn(what, RuntimeWarning, stacklevel=5 + depth)


def _warn_of_pose(i: int | np.intp, why: str) -> None:
    cure = "rbcourse.outliers.wrong_poses finds wrong poses"
    _warn(f"poses[{i}] or a pose near it may be wrong: its {why}; {cure}", 1)


def _warn_of_jump(i: int | np.intp, part: str, ratio: float) -> None:
    _warn(
        f"poses[{i}]: the {part} jumps near it, {ratio:.0f} times as far as usual; if the poses "
        "before and after the jump are right, smooth them apart; otherwise "
        "rbcourse.outliers.wrong_poses finds those that are wrong",
        1,
    )


def _check_gaps(smoother: Smoother, periods: Any) -> None:
    """Warn if the longest step is a gap, in which the motion is not known.

    In gaps of 1, 1.5 and 2 periods, the largest error is 3, 5 and 30 times the usual error.
    """
    knots, period = smoother.knots, np.min(periods)
    steps = np.diff(knots)
    gaps = steps > max(period, GAP * usual_step(steps))
    if not gaps.any():
        return
    i = np.argmax(steps)
    where = f"between {knots[i]:.13g} and {knots[i + 1]:.13g}"
    cure = "smooth both sides apart"
    if gaps.sum() > MANY_GAPS:
        where += f" and in {gaps.sum() - 1} other intervals"
        cure = "the times may be those at which the poses were received"
    _warn(
        f"times: no pose {where}, longer than the period {period:.3g}, so the motion there is not "
        f"known; {cure}"
    )


def _check_period(smoother: Smoother, periods: Any) -> None:
    """Warn if a given period is so short that nothing is smoothed."""
    period, step = np.min(periods), usual_step(np.diff(smoother.knots))
    if period < SHORTEST * step:
        _warn(
            f"period: {period:g} is shorter than a tenth of a step, {step:.3g}, so nothing is "
            "smoothed, and the noise is not known; times and period have the same unit"
        )


def _check_held(smoother: Smoother, poses: Array) -> bool:
    """Warn if poses equal the pose before exactly, although the body moves.

    A tracker that has no new pose may repeat the last one. Counted are short runs of equal poses
    that end with at least a fifth of the usual largest step, since the last digits of a body at
    rest change less. One run, of any length, is enough if the step after it is a jump. Equal poses
    at the start may be a rest.
    """
    step = np.abs(np.diff(poses, axis=0)).max(axis=(1, 2))
    if len(step) < 2 * NEAR or not step.any():
        return False
    usual = np.quantile(step[step > 0], 0.95)
    equal = (step == 0) & (np.diff(smoother.which) > 0)
    ends = np.flatnonzero(~equal)
    runs = np.diff(ends, prepend=ends[0]) - 1  # the number of equal steps before each end
    moves = (runs > 0) & (runs < 2 * NEAR) & (step[ends] > STILL * usual)
    jumps = (runs >= LONG_RUN) & (step[ends] > JUMP * usual)
    if runs[moves].sum() <= max(NEAR, MANY_HELD * len(step)) and not jumps.any():
        return False
    found = moves | jumps
    first = ends[found][0] - runs[found][0] + 1
    _warn(
        f"poses: {runs[found].sum()} poses, such as poses[{first}], equal the one before, although "
        "the body moves; if a tracker has repeated its last pose, smooth the new ones alone: "
        "new = np.append(True, (poses[1:] != poses[:-1]).any((1, 2)))"
    )
    return True


def _check_rest(smoother: Smoother, poses: Array) -> None:
    """Warn if the body moves at an end, although the curve is at rest there.

    It moves if the slope at the end, of parabolas that are fitted to twenty poses, is most of their
    mean slope, and clearly larger than its standard error.
    """
    some = np.arange(min(2 * NEAR, len(poses)))
    if len(some) < 8:
        return
    t = smoother.knots[smoother.which]
    for name, i in (("first", some), ("last", len(poses) - 1 - some)):
        share = (t[i] - t[i[0]]) / (t[i[-1]] - t[i[0]])
        fit = np.linalg.pinv(share[:, None] ** [0, 1, 2])
        parts = {"turns": log(poses[i[0], :3, :3].T @ poses[i, :3, :3])}
        if poses.shape[-1] == 4:
            parts["moves"] = poses[i, :3, 3] - poses[i[0], :3, 3]
        for how, x in parts.items():
            _, slope, bend = fit @ x
            left = x - np.stack([share, share**2], axis=1) @ [slope, bend]
            left -= left.mean(axis=0)
            error = np.linalg.norm(fit[1]) * np.sqrt(np.sum(left**2) / (3 * len(i) - 9))
            along, size = slope @ (slope + bend), np.linalg.norm(slope + bend)
            if along > MOST_SLOPE * size**2 and along > CLEAR * error * size > 0:
                _warn(f"ends: the body {how} at the {name} pose, so it is not at rest there")


def _interpolated(smoother: Smoother, poses: Array) -> str:
    """Return a warning if the poses are on straight lines between some of them, or "".

    The velocity jumps at one pose, or between two, and their distances are far larger than half of
    the distances. Next to a wrong pose, three poses have such distances. Rounded coordinates of a
    slow motion also jump, but do not change between the jumps.
    """
    least = ROUNDING * (1 + np.abs(poses).max())
    for part, (off, step) in _from_lines(smoother, poses).items():
        if np.median(step) < least:
            continue
        usual = max(np.median(off), least)
        bent = np.pad(off > BENT * usual, 1)
        starts, stops = np.flatnonzero(bent[1:] != bent[:-1]).reshape(-1, 2).T
        peaks = np.array([off[i:k].max() for i, k in zip(starts, stops, strict=True)])
        kinks = peaks > KINK * usual
        if kinks.sum() > MANY_KINKS and np.mean((stops - starts)[kinks] <= 2) > MOST_KINKS:
            return (
                f"poses: the velocity of the {part} jumps at {kinks.sum()} poses, such as "
                f"poses[{starts[kinks][0] + 1}], and hardly changes between them; if the poses "
                "are interpolated, smooth the original ones, or give period"
            )
    return ""


def _check_neighbours(smoother: Smoother, poses: Array) -> bool:
    """Warn if a pose is far from the line through the poses before and after it.

    It is far if its distance is five times the usual one near it, and larger than the usual step
    there: where the velocity of a motion jumps, the distance is at most a step. It is also larger
    than the least step, since rounded coordinates of a slow motion jump by their last digit.
    """
    found, h = False, np.diff(smoother.knots)
    bend = h[1:] * h[:-1]  # the distance of a motion with an acceleration is bend/2 times it
    for part, (off, step) in _from_lines(smoother, poses).items():
        least = max(_least(step) / OFF_LINE, ROUNDING * (1 + np.abs(poses).max()))
        usual = np.maximum(_usual_near(off), least)
        if not (off > OFF_LINE * usual).any():
            continue
        longer = np.maximum(bend / _usual_near(bend), 1)
        ratio = np.where(off > _usual_near(step), off / (longer * usual), 0)
        i, largest = np.argmax(ratio), ratio.max()
        if largest <= OFF_LINE:
            continue
        found = True
        beside = np.pad(off, 1)
        i += np.argmax(beside[i : i + 3]) - 1
        before, here, after = beside[i : i + 3]
        if max(before, after) > ALIKE * here:
            _warn_of_jump(i + 1, part, largest)
        else:
            far = f"{part} is {largest:.0f} times as far from the line through its neighbours as"
            _warn_of_pose(i + 1, f"{far} usual")
    return found


def _from_lines(smoother: Smoother, poses: Array) -> dict[str, tuple[Array, Array]]:
    """Return distances of poses from the line through their neighbours, and their last steps.

    There may be too few poses, or several at a time; then nothing is returned.
    """
    t = smoother.knots
    if len(poses) != len(t) or len(t) < 2 * NEAR:
        return {}
    share = ((t[1:-1] - t[:-2]) / (t[2:] - t[:-2]))[:, None]
    before, R, after = poses[:-2, :3, :3], poses[1:-1, :3, :3], poses[2:, :3, :3]
    between = before @ exp_so3(share * log(before.mT @ after))
    found = {"turn": (angle_between(between, R), angle_between(before, R))}
    if poses.shape[-1] == 4:
        first, x, last = (poses[part, :3, 3] for part in (np.s_[:-2], np.s_[1:-1], np.s_[2:]))
        off = first + share * (last - first) - x
        found["origin"] = np.linalg.norm(off, axis=1), np.linalg.norm(x - first, axis=1)
    return found


def _least(step: Array) -> float:
    """Return the least step above 0, or 0."""
    return float(step[step > 0].min()) if step.any() else 0.0


def _usual_near(x: Array) -> Array:
    """Return an upper bound of three quarters of the values before or after each one."""
    before, after = (np.sort(side, axis=1)[:, 3 * NEAR // 4] for side in _around(x))
    return np.maximum(before, after)


def _around(x: Array) -> tuple[Array, Array]:
    """Return the ten values before each value, and the ten after it; they are reflected at ends."""
    around = sliding_window_view(np.pad(x, NEAR, mode="reflect"), NEAR)
    return around[: len(x)], around[NEAR + 1 :]


def _check_noise(smoother: Smoother, periods: Any, noise: ArrayLike | None) -> None:
    """Warn if there are few poses, or if the best of the tried periods is the least one."""
    if noise is None and len(smoother.knots) < FEW:
        _warn(
            f"cross validation of {len(smoother.knots)} poses may take the motion for noise, and "
            f"{FEW} or more are wanted; give noise or period"
        )
        return
    least = smoother.is_least(periods)
    if least.any():
        part = ("rotations: ", "origins: ")[np.argmax(least)] if least.size == 2 else ""
        why = "cross validation finds nothing to smooth, so the noise is not known; give noise"
        if noise is not None:
            why = "nothing is smoothed; some poses are wrong, or noise is too small; change it"
        _warn(f"{part}{why} or period")


def _check_poses(smoother: Smoother, curve: Any, poses: Array) -> None:
    """Warn if a pose is much farther from the curve than half of the poses are.

    Poses on the curve are not counted: those of a rest may have no noise. A wrong pose is farther
    than the least step, since rounded coordinates of a slow motion jump by their last digit.
    """
    near = curve(smoother.knots)[smoother.which]
    turn = log(near[:, :3, :3].mT @ poses[:, :3, :3])
    errors = {"turn": turn, "origin": near[:, :3, 3:] - poses[:, :3, 3:]}
    leasts = map(_least, distances(poses[:-1], poses[1:]))
    for (part, error), step, shortest in zip(
        errors.items(), leasts, smoother.is_least(curve.period), strict=False
    ):
        size = np.sqrt(smoother.weights) * np.linalg.norm(error.reshape(-1, 3), axis=1)
        i, off = np.argmax(size), size > ROUNDING * (1 + np.abs(poses).max())
        usual = np.median(size[off]) if off.any() else np.inf
        if size[i] > max(WRONG * usual, step) and not shortest:
            far = f"{part} is {size[i] / usual:.0f} times as far from the curve as usual"
            _warn_of_pose(i, far)


def _check_dependent(smoother: Smoother, curve: Any, poses: Array) -> None:
    """Warn if cross validation follows errors that are alike in neighbouring poses.

    For independent errors of the size σ, a period of P steps is right for a motion that moves by
    about σ (T/P)^4.5 T^-1.5 in a step, if T is the period of the motion in steps; so if the body
    moves by little and P is short, T must be short, too.
    """
    if len(poses) < 10 * NEAR:
        return
    several = distances(poses[:-NEAR], poses[NEAR:])
    noises, periods = np.atleast_1d(curve.noise), np.atleast_1d(curve.period) / smoother.unit
    for part, move, noise, period in zip(
        ("turn", "origin"), several, noises, periods, strict=False
    ):
        step = np.sqrt(np.mean(move**2)) / NEAR
        slow = step * (period / SHORT) ** 4.5 < SLOW * noise
        if slow and LEAST_OF_SHORT < period < SHORT and (part == "origin" or step < SMALL_TURN):
            _warn(
                f"poses: the {part} seems to oscillate within {period:.1f} steps, so errors of "
                "neighbouring poses may be alike, as after a filter or by rounding; if the body "
                "does not oscillate, give period"
            )


def distances(some: Array, others: Array) -> list[Array]:
    """Return the angles between rotations and, of poses, the distances of the origins."""
    found = [angle_between(some[:, :3, :3], others[:, :3, :3])]
    if some.shape[-1] == 4:
        found.append(np.linalg.norm(some[:, :3, 3] - others[:, :3, 3], axis=1))
    return found
