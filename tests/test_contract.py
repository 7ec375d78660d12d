"""Test that all functions that make curves keep the contract.

The functions, their options and their groups come from the package: a function of `rbcourse` or of
`closed_forms` that has the parameters `start` and `goal` is tested here without an edit.
"""

import inspect
import itertools
import math
import pickle
import typing
from dataclasses import fields
from functools import cache, partial

import numpy as np
import oracles
import pytest

import rbcourse as rb

FUNCTIONS = rb.closed_forms.FORMS | {
    name: function
    for module in (rb, rb.closed_forms)
    for name in module.__all__
    if inspect.isfunction(function := getattr(module, name))
    and {"start", "goal"} <= set(inspect.signature(function).parameters)
}
REFUSED = {"screw": 3, "minimum_torque": 4, "minimum_jerk": 4}
"""The size of the matrices that these functions refuse; all others take rotations and poses."""
ORDERS = {"start": 0, "goal": 0, "v0": 1, "v1": 1, "a0": 2, "a1": 2}
"""The arguments that state the ends of a curve, and the orders of their derivatives."""
CENTRE, MASS = np.array([0.1, -0.2, 0.3]), 1.3


def uneven(c, t, order):
    """Return a reparameterisation for each curve; with c > 1 it leaves [0, 1]."""
    return (t + c * t * (1 - t), 1 + c * (1 - 2 * t), -2 * c + 0 * t, 0 * c * t)[order]


OPTIONS = {
    "body": lambda ends: rb.Body(ends["inertia"], MASS, CENTRE),
    "long": lambda ends: True,
    "f": lambda ends: partial(
        uneven, np.vecdot(ends["start"][..., :3, :3], ends["goal"][..., :3, :3]).sum(axis=-1)
    ),
}
"""Arguments that are tested if a function has them; if they have a default, also without them."""


class Maker:
    """A function that makes curves of one group, with some of its options."""

    def __init__(self, function, size, *options):
        self.function, self.size, self.options = function, size, options
        self.parameters = inspect.signature(function).parameters
        names = [name for name in ORDERS if name in self.parameters]
        self.names = names or ["start", "goal", "v0", "v1"]  # of a function of this module

    def __call__(self, ends, **given):
        chosen = {name: OPTIONS[name](ends) for name in self.options}
        return self.function(*(ends[name] for name in self.names), **chosen | given)


def needed(function):
    has = inspect.signature(function).parameters
    return [key for key in OPTIONS if key in has and has[key].default is has[key].empty]


def makers():
    """Return a dict of all functions, with each option."""
    found = {}
    for name, function in FUNCTIONS.items():
        for option in [
            None,
            *(key for key in OPTIONS if key in inspect.signature(function).parameters),
        ]:
            options = sorted({*needed(function), option} - {None})
            sizes = {3, 4} if option in (None, "body") else {3}  # others change the rotation alone
            for size in sizes - {REFUSED.get(name)}:
                found["-".join([name, *options, str(size)])] = Maker(function, size, *options)
    return found


def sample(*batch, seed=0, size=1, group=3):
    """Return ends of all kinds: turns of up to 2 rad and moderate rates, both scaled by `size`."""
    rng = np.random.default_rng([104, seed])
    R0, Q = rb.sample_rotation((2, *batch), rng=rng)
    R1 = R0 @ rb.exp_so3(size * rng.uniform(-1.15, 1.15, (*batch, 3)))
    rates = size * rng.uniform(-1, 1, (4, *batch, 6))
    d0, d1 = size * rng.uniform(-1, 1, (2, *batch, 3))
    G = Q @ (rng.uniform(1, 1.9, (*batch, 3, 1)) * Q.mT)
    ends = [R0, R1, *rates[..., :3]]
    if group == 4:
        ends = [rb.pose_from_components(R0, d0), rb.pose_from_components(R1, d1), *rates]
    return dict(zip(ORDERS, ends, strict=True)) | {"inertia": (G + G.mT) / 2}


def part(ends, index):
    return {name: value[index] for name, value in ends.items()}


def frame(group, seed, *, shifted=True):
    """Return a frame, and the matrix that takes velocities in it to those in the old frame."""
    A = sample(seed=seed, group=4)["start"]
    A[:3, 3] *= shifted
    return (A, rb.adjoint_se3(A)) if group == 4 else (A[:3, :3], A[:3, :3])


def moved(start, goal, v0, v1):
    """Return the cubic with these ends as a curve that is moved; its body is not a ball."""
    group = start.shape[-1]
    (L, _), (X, old) = frame(group, 5), frame(group, 6)
    start, goal = (np.linalg.inv(L) @ A @ np.linalg.inv(X) for A in (start, goal))
    body = rb.Body(np.diag([1.0, 1.2, 1.5]), MASS, CENTRE)
    return cubic(start, goal, v0 @ old.T, v1 @ old.T, body=body).moved(L, X)


cubic = rb.projected_cubic
DERIVED = {
    "retimed": lambda A, B, v, w: cubic(A, B, v / 2, w / 2).retimed(0.5),
    "moved": moved,
}
MAKERS = makers() | {
    f"{name}-{size}": Maker(function, size) for name, function in DERIVED.items() for size in (3, 4)
}
MAKERS["stationary-3"] = Maker(lambda *ends: rb.optimum.stationary(cubic(*ends)), 3)
CORES = {3: [(3, 3), (3,), (3,), (3,)], 4: [(4, 4), (6,), (6,)]}  # each order has its core shape


@cache
def made(make, *batch):
    """Return the curve with the ends of `sample`; each curve is made once."""
    return make(sample(*batch, group=make.size))


def times(curve, *shape):
    start, end = curve.domain
    end = min(end, start + 3)  # the domain of an empty stack is unbounded
    return start + (end - start) * np.random.default_rng(93).random(shape)


def jet(curve, t, own=False):
    """Return the curve and its derivatives, with all components on the last axis; check their
    shapes."""
    call, shape = (curve.at_own_times, t.shape) if own else (curve, t.shape + curve.batch_shape)
    cores = CORES[curve.size]
    values = [call(t, order) for order in range(len(cores))]
    assert [value.shape for value in values] == [shape + core for core in cores]
    flat = zip(values, cores, strict=True)
    return np.concatenate([x.reshape(*shape, math.prod(core)) for x, core in flat], axis=-1)


def off(a, b):
    """Return the largest difference, relative to the largest entry of its component or to 1."""
    others = tuple(range(np.ndim(b) - 1))
    scale = np.abs(b).max(axis=others, initial=1)
    return (np.abs(np.subtract(a, b, dtype=float)).max(axis=others, initial=0) / scale).max()


def meets_its_ends(make):
    """Check that the curve has the given rotations or poses, velocities and accelerations."""
    ends, curve = sample(2, 3, group=make.size), made(make, 2, 3)
    for name in make.names:
        t = curve.domain[name in ("goal", "v1", "a1")]
        order = ORDERS[name]
        assert off(curve(t, order), ends[name]) < (1e-11 if order else 1e-13)


def has_the_derivatives_of_its_values(make):
    """Check R' = R ŵ, w' and w''; on SE(3) also Rᵀ d' and Rᵀ d'', as defined in `Curve`. Small
    motions are tested, too."""
    sizes = np.array([1, 1, 1] if "long" in make.options else [1, 1e-3, 1e-7])
    curve = make(sample(3, size=sizes[:, None], group=make.size))
    start, end = curve.domain
    t = start + (end - start) * np.array([0.1, 0.37, 0.8])

    def slope(f):
        return oracles.derivative_by_differences(f, t, (end - start) / 1024)

    R, moving = curve(t)[..., :3, :3], slope(curve)
    assert off(curve(t, 1)[..., :3], rb.vee_so3(R.mT @ moving[..., :3, :3])) < 1e-9
    for order in range(2, len(CORES[curve.size])):
        below, faster = curve(t, order - 1), slope(lambda t, k=order - 1: curve(t, k))
        scale = sum(np.abs(x[..., :3]).max(axis=(0, 2)) for x in (below, faster))
        miss = np.abs(faster - curve(t, order))[..., :3].max(axis=(0, 2))
        assert np.all(miss < 1e-11 * scale + 1e-12 * sizes)
    if curve.size == 4:
        assert off(curve(t, 1)[..., 3:], (R.mT @ moving[..., :3, 3:])[..., 0]) < 1e-9
        path = slope(lambda t: curve(t)[..., :3, :3] @ curve(t, 1)[..., 3:, None])
        assert off(curve(t, 2)[..., 3:], (R.mT @ path)[..., 0]) < 1e-9
    assert off(curve.twist_rate(t), slope(lambda t: curve(t, 1))) < 1e-9


def is_the_stack_of_its_members(make):
    """Check that every member of a stack equals the single curve, and that ends broadcast."""
    ends, stack = sample(2, 3, group=make.size), made(make, 2, 3)
    t = times(stack, 5)
    values = jet(stack, t)
    assert stack.batch_shape == (2, 3)
    for i in np.ndindex(2, 3):
        one = make(part(ends, i))
        want = jet(one, t)
        assert one.batch_shape == ()
        assert off(values[:, *i], want) < 1e-11
        assert off(jet(stack[i], t), want) < 1e-11
    ends, starts = sample(2, group=make.size), ("start", "v0", "a0")
    first = {name: value[0] if name in starts else value for name, value in ends.items()}
    last = {name: value if name in starts else value[1] for name, value in first.items()}
    assert off(make(first)(t)[:, 1], make(last)(t)) < 1e-11


def is_the_same_at_one_time_and_in_one_pass(make):
    """Check `state`, and single times of a single curve, for which there is a separate path."""
    stack = made(make, 2)
    t = np.append(times(stack, 3), stack.domain)
    for curve in (stack, stack[1]):
        values = [curve(t, order) for order in range(len(CORES[make.size]))]
        state = curve.state(t)
        found = state.pose, state.velocity, state.acceleration
        assert all(map(np.array_equal, found, values))
        for i, time in enumerate(t):
            for order, want in enumerate(values):
                assert off(curve(time, order), want[i]) < 1e-13
            for one, want in zip(curve.state(time), values, strict=False):
                assert off(one, want[i]) < 1e-13


def has_values_at_times_of_any_shape(make):
    """Check times of several shapes, no times, very many times, and an empty stack."""
    for batch in ((), (2,), (0,), (2, 0)):
        curve = made(make, *batch)
        assert jet(curve, times(curve, 0)).size == 0
        t = times(curve, 2, 3)
        assert np.array_equal(jet(curve, t).ravel(), jet(curve, t.ravel()).ravel())
        assert off(jet(curve, t[0, 0]), jet(curve, t[0, :1])[0]) < 1e-13
    curve = made(make, 2)
    t = times(curve, 2600)  # for two curves, these times fill more than one block
    values = jet(curve, t)
    for part in (slice(1), slice(1, 40), slice(2500, 2600)):
        assert off(jet(curve, t[part]), values[part]) < 1e-12
    many = curve[np.arange(100) % 2]
    assert off(jet(many, t[:60]), values[:60, [0, 1] * 50]) < 1e-12


def takes_each_curve_at_its_own_times(make):
    stack = made(make, 2, 3)
    t = times(stack, 4, 2, 3)
    values = jet(stack, t, own=True)
    for i in np.ndindex(2, 3):
        assert off(values[:, *i], jet(stack, t[:, *i])[:, *i]) < 1e-12
    for shape in ((), (3,), (3, 2), (2, 3, 1)):
        with pytest.raises(ValueError, match=r"^t: shape .* is wanted, got"):
            stack.at_own_times(np.zeros(shape))


INDICES = [(1, 2), 0, (slice(None), -1), ..., np.s_[:0], (None, 1, slice(1, None))]
INDICES += [([1, 0, 1], [2, 2, 0]), np.array([[True, False, True], [False, False, True]])]


def is_indexed_as_an_array_is(make):
    """Check indexing of a stack, and of the attributes that describe its curves."""
    stack = made(make, 2, 3)
    t = times(stack, 3)
    values, numbers = jet(stack, t), np.arange(6).reshape(2, 3)
    names = "margin", "margin_time", "converged", "nodes", "c", "cost", "rotation_vector", "twist"
    told = [name for name in names if hasattr(stack, name)]
    for index in INDICES:
        some = stack[index]
        assert some.batch_shape == numbers[index].shape
        assert off(jet(some, t), values.reshape(3, 6, -1)[:, numbers[index]]) < 1e-12
        for name in told:
            want = np.asarray(getattr(stack, name))[index]
            np.testing.assert_allclose(getattr(some, name), want, rtol=1e-12, atol=1e-12)
    assert [one.batch_shape for one in stack] == [(3,), (3,)]
    assert (len(stack), len(stack[0, :0])) == (2, 0)
    assert all([stack[0, 0], stack[:0]])
    with pytest.raises(IndexError):
        stack[2]
    for call in (len, lambda one: one[0]):
        with pytest.raises(TypeError, match="a single curve"):
            call(stack[0, 0])


def keeps_and_changes_no_arguments(make):
    """Check that ends, times and returned arrays are independent of the curve."""
    for batch in ((2,), ()):
        ends, before = (sample(*batch, group=make.size) for _ in range(2))
        curve = make(ends)
        t = asked = times(curve, *[3][: len(batch)])
        t = t.copy()
        values = [curve(t, order) for order in range(len(CORES[curve.size]))]
        assert all(np.array_equal(ends[name], before[name]) for name in ends)
        assert np.array_equal(t, asked)
        first = [value.copy() for value in values]
        for value in (*ends.values(), *values):
            value.fill(np.nan)
        assert all(np.array_equal(curve(t, order), value) for order, value in enumerate(first))


def has_arrays_that_cannot_be_changed(make):
    curve = made(make, 2)
    with pytest.raises(AttributeError):
        curve.duration = 2
    for name in [field.name for field in fields(curve)] + ["margin", "certified", "body"]:
        value = getattr(curve, name, None)
        for array in (value, getattr(value, "inertia", None)):
            if isinstance(array, np.ndarray) and array.flags.writeable:
                before = array.copy()
                array.fill(0)
                assert np.array_equal(getattr(curve, name), before)


def refuses_bad_arguments_by_name(make):
    for name in make.names:
        ends = sample(2, group=make.size)
        good, bad = ends[name], []
        for kind, entry in ((float, np.nan), (complex, 1j), (object, "a")):
            bad.append(good.astype(kind))
            bad[-1][(1,) + (0,) * (good.ndim - 1)] = entry
        bad += [np.zeros(shape) for shape in ((), (2,), (2, 4), (2, 3, 2), (2, 5, 5))]
        bad += [[[[1.0, 0, 0], [0, 1]]], np.ma.masked_less(good, 0)]
        for one in bad:
            with pytest.raises(ValueError, match=rf"^{name}"):
                make(ends | {name: one})
        with pytest.raises(ValueError, match=name):
            make(ends | {name: sample(3, group=make.size)[name]})


def refuses_bad_times_and_orders(make):
    curve = made(make, 2)
    start, end = curve.domain
    for t in (start - 1e-6, end + 1e-6, np.nan, np.inf, [start, np.nan], "a", 1j):
        with pytest.raises(ValueError, match=r"^t"):
            curve(t)
    for order in (-1, len(CORES[curve.size]), 1.0, True, "1"):
        with pytest.raises(ValueError, match=r"^order"):
            curve(start, order)


def is_the_same_after_pickling(make):
    curve = made(make, 2)
    again = pickle.loads(pickle.dumps(curve))
    t = times(curve, 3)
    assert np.array_equal(jet(again, t), jet(curve, t))
    assert repr(again) == repr(curve)
    assert repr(again.body) == repr(curve.body)
    assert np.array_equal(again.body.inertia, curve.body.inertia)
    assert f"on S{'OE'[curve.size - 3]}({curve.size - (curve.size == 4)})" in repr(curve)


def moves_with_its_ends(make):
    """Check that the ends L A0 X and L A1 X give the curve L A(t) X, which `moved` returns.

    For a body, X is any frame; for other functions, it is a rotation.
    """
    ends, curve = sample(2, group=make.size), made(make, 2)
    (L, _), (X, old) = frame(make.size, 1), frame(make.size, 2, shifted="body" in make.options)
    if make.function in DERIVED.values():
        X, old = np.eye(len(X)), np.eye(len(old))
    given = {name: ends[name] @ np.linalg.inv(old).T for name in make.names[2:]}
    given |= {name: L @ ends[name] @ X for name in ("start", "goal")}
    body = OPTIONS["body"](ends).moved(X[:3, :3], X[:3, 3] if make.size == 4 else np.zeros(3))
    same = make(ends | given, **{"body": body} if "body" in make.options else {})
    t = times(curve, 3)
    assert off(same(t), L @ curve(t) @ X) < 1e-10
    assert off(same(t, 1), curve(t, 1) @ np.linalg.inv(old).T) < 1e-9
    assert off(jet(curve.moved(L, X), t), jet(same, t)) < 1e-9


def is_reversed_with_its_ends(make):
    """Docstrings state which functions lack this symmetry; a timing f may lack it, too."""
    ends, curve = sample(2, group=make.size), made(make, 2)
    if "f" in make.options:
        return
    pairs = zip(make.names[::2], make.names[1::2], strict=True)
    other = {a: b for pair in pairs for a, b in (pair, pair[::-1])}
    back = {name: (-1) ** ORDERS[name] * ends[other[name]] for name in make.names}
    (start, end), t = curve.domain, times(curve, 3)
    want, found = jet(curve, t), jet(make(ends | back), start + end - t)
    velocity = slice(make.size**2, make.size**2 + 3 * make.size - 6)
    found[..., velocity] *= -1
    if make.size == 3:
        found[..., 15:] *= -1
    text = " ".join((make.function.__doc__ or "").split())
    one_way = "do not give the reversed curve" in text
    assert (off(found, want) < 1e-9) != one_way


def costs_the_same_if_it_is_moved(make):
    """The new body frame has another origin, so that the centre of the body is elsewhere in it."""
    curve = made(make, 2)
    other = curve.moved(*(frame(make.size, seed)[0] for seed in (1, 2)))
    cost = rb.acceleration_cost(curve, rtol=1e-8)
    assert rb.acceleration_cost(other, rtol=1e-8) == pytest.approx(cost, rel=1e-7, abs=1e-18)


def knows_its_body(make):
    """Members of a stack, slower curves and moved curves keep the body."""
    stack = made(make, 2)
    given = sample(2)["inertia"]
    if make.function not in DERIVED.values():
        want = OPTIONS["body"]({"inertia": given}) if "body" in make.options else rb.Body.ball()
        assert np.array_equal(stack.body.inertia, want.inertia)
        assert np.array_equal([stack.body.mass, *stack.body.centre], [want.mass, *want.centre])
    inertias = np.broadcast_to(stack.body.inertia, (2, 3, 3))
    for i, one in enumerate(stack):
        for other in (one, one.retimed(3), one.moved()):
            assert np.array_equal(other.body.inertia, inertias[i])
            assert np.array_equal(other.body.centre, stack.body.centre)
            assert other.body.mass == stack.body.mass


def lasts_as_long_as_it_is_told(make):
    """Multiply the rates by T, make the curve on [0, 1], and retime it. The result must equal the
    curve of duration T."""
    if "duration" not in make.parameters:
        return  # a curve without the parameter `duration` keeps its own duration
    ends, T = sample(3, group=make.size), np.array([0.5, 1, 1.5])
    curve = make(ends, duration=T)
    slow = {name: ends[name] * T[:, None] ** ORDERS[name] for name in make.names[2:]}
    unit = make(ends | slow)
    assert np.array_equal(curve.duration, T)
    assert off(getattr(curve, "margin_time", 0), getattr(unit, "margin_time", 0) * T) < 1e-6
    assert curve.domain == (0, 0.5)
    t = np.random.default_rng(94).random((4, 3))
    powers = np.repeat(range(len(CORES[curve.size])), [*map(math.prod, CORES[curve.size])])
    for same in (curve, unit.retimed(T)):
        want = jet(unit, t, own=True) / T[:, None] ** powers
        assert off(jet(same, t * T, own=True), want) < 1e-11
    assert off(curve[2](1.5 * t[:, 2]), curve.at_own_times(t * T)[:, 2]) < 1e-12
    for bad in (0, -1, np.nan, 1e-200, "a", [1, 2]):
        with pytest.raises(ValueError, match="duration"):
            make(ends, duration=bad)


CONTRACT = [
    meets_its_ends,
    has_the_derivatives_of_its_values,
    is_the_stack_of_its_members,
    has_values_at_times_of_any_shape,
    takes_each_curve_at_its_own_times,
    is_indexed_as_an_array_is,
    is_the_same_at_one_time_and_in_one_pass,
    keeps_and_changes_no_arguments,
    has_arrays_that_cannot_be_changed,
    refuses_bad_arguments_by_name,
    refuses_bad_times_and_orders,
    is_the_same_after_pickling,
    moves_with_its_ends,
    is_reversed_with_its_ends,
    costs_the_same_if_it_is_moved,
    knows_its_body,
    lasts_as_long_as_it_is_told,
]


@pytest.mark.parametrize("make", MAKERS.values(), ids=MAKERS)
@pytest.mark.parametrize("clause", CONTRACT)
def test_a_curve_keeps_the_contract(make, clause):
    checked = make.function in FUNCTIONS.values() and "f" not in make.options
    if checked or clause is not refuses_bad_arguments_by_name:
        clause(make)


def test_the_forms_that_the_course_compares_have_the_same_arguments_and_different_first_words():
    forms = rb.closed_forms.FORMS
    assert len({name.partition("_")[0] for name in forms}) == len(forms)
    for name, make in forms.items():
        parameters = inspect.signature(make).parameters.values()
        needed = [
            p.name for p in parameters if p.default is p.empty and p.kind is not p.KEYWORD_ONLY
        ]
        positional = [p.name for p in parameters if p.kind is not p.KEYWORD_ONLY]
        assert positional[:4] == ["start", "goal", "v0", "v1"], name
        assert set(needed) <= {"start", "goal", "v0", "v1"}, name


def test_every_function_that_returns_a_curve_is_tested():
    """Functions of paths and of curves have tests of their own: `test_paths.py` and others."""
    for module in (rb, rb.closed_forms):
        for name in set(module.__all__) - set(FUNCTIONS):
            function = getattr(module, name)
            kind = inspect.isfunction(function) and typing.get_type_hints(function)["return"]
            if inspect.isclass(kind) and issubclass(kind, rb.Curve):
                first = next(iter(inspect.signature(function).parameters))
                assert first in ("times", "curve", "rotation")
    assert len(FUNCTIONS) >= 16


@pytest.mark.parametrize("name", REFUSED)
def test_the_other_group_is_refused(name):
    size = REFUSED[name]
    make = Maker(FUNCTIONS[name], size, *needed(FUNCTIONS[name]))
    with pytest.raises(ValueError, match=f"^start, goal: .*got {['rotations', 'poses'][size - 3]}"):
        make(sample(group=size))


@pytest.mark.parametrize("name", FUNCTIONS)
def test_errors_name_the_ends_that_do_not_fit_each_other(name):
    """Every combination of rotations and poses with velocities of both sizes is tried."""
    size, other = (4, 3) if name == "screw" else (3, 4)
    make = Maker(FUNCTIONS[name], size, *needed(FUNCTIONS[name]))
    groups = sample(group=size), sample(group=other)
    for chosen in itertools.product((0, 1), repeat=len(make.names)):
        ends = {key: groups[i][key] for key, i in zip(make.names, chosen, strict=True)}
        misfits = [key for key, i in zip(make.names, chosen, strict=True) if i != chosen[0]]
        if misfits:
            named = "start, goal" if "goal" in misfits else misfits[0]
            with pytest.raises(ValueError, match=f"^{named}: .* wanted"):
                make(groups[0] | ends)
