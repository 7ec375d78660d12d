"""Test that all functions that make curves keep the contract, and that its checks detect faults."""

import inspect
import math
import pickle
import typing
from copy import copy
from functools import cache, partial

import numpy as np
import oracles
import pytest

import rbcourse as rb


def of(function, *more):
    """Return a function that calls `function` with its required ends and those in `more`."""
    parameters = inspect.signature(function).parameters.values()

    def make(ends, **given):
        return function(**{name: ends[name] for name in make.names}, **given)

    make.names = [*(p.name for p in parameters if p.default is p.empty), *more]
    make.function = function
    return make


def uneven(c, t, order):
    """Return a reparameterisation for each curve; with c > 1 it leaves [0, 1]."""
    return (t + c * t * (1 - t), 1 + c * (1 - 2 * t), -2 * c + 0 * t, 0 * c * t)[order]


def timed(R0, R1):
    c = np.trace(np.swapaxes(R0, -1, -2) @ R1, axis1=-2, axis2=-1)
    return rb.projected_line(R0, R1, partial(uneven, c))


def returns_a_curve(function):
    kind = typing.get_type_hints(function)["return"]
    return inspect.isclass(kind) and issubclass(kind, rb.Curve)


FUNCTIONS = rb.closed_forms.FORMS | {
    name: function
    for name in rb.__all__
    if inspect.isfunction(function := getattr(rb, name)) and returns_a_curve(function)
}
NO_STACKS = {  # tested in test_paths.py, test_splines.py and test_timing.py
    name
    for name, function in FUNCTIONS.items()
    if issubclass(typing.get_type_hints(function)["return"], rb.Chain | rb.Timed)
}
bezier, cubic = rb.closed_forms.bezier, rb.projected_cubic
MAKERS = {
    **{name: of(function) for name, function in FUNCTIONS.items() if name not in NO_STACKS},
    "retime": of(lambda R0, R1: rb.retime(rb.geodesic(R0, R1), 2.5)),
    "stationary_so3": of(lambda R0, R1, w0, w1: rb.optimum.stationary(bezier(R0, R1, w0, w1))),
    "minimum_acceleration of a body": of(rb.minimum_acceleration, "inertia"),
    "minimum_acceleration of a body": of(rb.minimum_acceleration, "inertia"),
    "minimum_acceleration off centre": of(
        partial(rb.minimum_acceleration, centre=[0.1, -0.2, 0.3])
    ),
    "projected_line with f": of(timed),
    "retime of a projection": of(lambda R0, R1, w0, w1: rb.retime(cubic(R0, R1, w0, w1), 0.5)),
}
CORES = {3: [(3, 3), (3,), (3,), (3,)], 4: [(4, 4), (6,), (6,)]}  # each order has its core shape
RATES = {"w0": 1, "w1": 1, "d0_dot": 1, "d1_dot": 1, "a0": 2, "a1": 2}


def sample(*batch, seed=0, size=1):
    """Return ends of all kinds: turns of up to 2 rad and moderate rates, both scaled by `size`."""
    rng = np.random.default_rng([104, seed])
    R0, Q = rb.sample_rotation((2, *batch), rng=rng)
    R1 = R0 @ rb.exp_so3(size * rng.uniform(-1.15, 1.15, (*batch, 3)))
    w0, w1, a0, a1, d0, d1, v0, v1 = size * rng.uniform(-1, 1, (8, *batch, 3))
    G = Q @ (rng.uniform(1, 1.9, (*batch, 3, 1)) * Q.mT)
    A0, A1 = rb.pose_from_components(R0, d0), rb.pose_from_components(R1, d1)
    names = ["R0", "R1", "w0", "w1", "a0", "a1", "inertia", "A0", "A1", "d0_dot", "d1_dot"]
    values = R0, R1, w0, w1, a0, a1, (G + G.mT) / 2, A0, A1, v0, v1
    return dict(zip(names, values, strict=True))


@cache
def made(make, *batch):
    """Return the curve with the ends of `sample`; each curve is made once."""
    return make(sample(*batch))


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
    ends, curve = sample(2, 3), made(make, 2, 3)
    for k, t in enumerate(curve.domain):
        value = ends[f"{'RA'[curve.size - 3]}{k}"]
        assert off(curve(t), value) < 1e-13
        for order, name in ((1, f"w{k}"), (2, f"a{k}")):
            if name in make.names and make is not MAKERS["retime of a projection"]:
                assert off(curve(t, order)[..., :3], ends[name]) < 1e-11
        if f"d{k}_dot" in make.names:
            moved = (value[..., :3, :3] @ curve(t, 1)[..., 3:, None])[..., 0]
            assert off(moved, ends[f"d{k}_dot"]) < 1e-12


def has_the_derivatives_of_its_values(make):
    """Check R' = R ŵ, w' and w''; on SE(3) also Rᵀ d' and Rᵀ d'', as defined in `Curve`. Small
    motions are tested, too."""
    long = make.function in (rb.exponential_cubic_long_so3, rb.bezier_long_so3)
    sizes = np.array([1, 1, 1] if long else [1, 1e-3, 1e-7])
    curve = make(sample(3, size=sizes[:, None]))
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


def is_the_stack_of_its_members(make):
    """Check that every member of a stack equals the single curve, and that ends broadcast."""
    ends, stack = sample(2, 3), made(make, 2, 3)
    t = times(stack, 5)
    values = jet(stack, t)
    assert stack.batch_shape == (2, 3)
    for i in np.ndindex(2, 3):
        one = make({name: value[i] for name, value in ends.items()})
        want = jet(one, t)
        assert one.batch_shape == ()
        assert off(values[:, *i], want) < 1e-11
        assert off(jet(stack[i], t), want) < 1e-11
    first = {name: value[0] if name[1] == "0" else value for name, value in sample(2).items()}
    last = {name: value if name[1] == "0" else value[1] for name, value in first.items()}
    assert off(make(first)(t)[:, 1], make(last)(t)) < 1e-11


def has_values_at_times_of_any_shape(make):
    """Check times of several shapes, no times, very many times, and an empty stack."""
    for batch in ((), (2,), (0,), (2, 0)):
        curve = made(make, *batch)
        assert jet(curve, times(curve, 0)).size == 0
        for shape in ((), (2, 3)):
            t = times(curve, *shape)
            assert np.array_equal(jet(curve, t).ravel(), jet(curve, t.ravel()).ravel())
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
            assert off(getattr(some, name), np.asarray(getattr(stack, name))[index]) < 1e-12
    assert [one.batch_shape for one in stack] == [(3,), (3,)]
    with pytest.raises(IndexError):
        stack[2]
    with pytest.raises(TypeError, match="a single curve"):
        stack[0, 0][0]


def keeps_and_changes_no_arguments(make):
    """Check that ends, times and returned arrays are independent of the curve."""
    ends, before = sample(2), sample(2)
    curve = make(ends)
    t, asked = times(curve, 3), times(curve, 3)
    values = [curve(t, order) for order in range(len(CORES[curve.size]))]
    assert all(np.array_equal(ends[name], before[name]) for name in ends)
    assert np.array_equal(t, asked)
    first = [value.copy() for value in values]
    for value in (*ends.values(), *values):
        value.fill(np.nan)
    assert all(np.array_equal(curve(t, order), value) for order, value in enumerate(first))


def refuses_bad_arguments_by_name(make):
    for name in make.names:
        good, bad = sample(2)[name], []
        for kind, entry in ((float, np.nan), (complex, 1j), (object, "a")):
            bad.append(good.astype(kind))
            bad[-1][(1,) + (0,) * (good.ndim - 1)] = entry
        bad += [np.zeros(shape) for shape in ((), (2,), (2, 4), (2, 3, 2), (2, 5, 5))]
        bad += [[[[1.0, 0, 0], [0, 1]]], np.ma.masked_less(good, 0)]
        for one in bad:
            with pytest.raises(ValueError, match=rf"^{name}"):
                make(sample(2) | {name: one})
        if len(make.names) > 1:
            with pytest.raises(ValueError, match=name):
                make(sample(2) | {name: sample(3)[name]})


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
    assert f"on S{'OE'[curve.size - 3]}({curve.size - (curve.size == 4)})" in repr(curve)


def moves_with_its_ends(make):
    """Check that the ends L A0 and L A1 give the curve L A(t). On SO(3), check also that the ends L
    R0 Q and L R1 Q, with the inertia turned by Q, give L R(t) Q."""
    ends, curve = sample(2), made(make, 2)
    L, Q = sample(seed=1), sample(seed=2)["R0"]
    t = times(curve, 3)
    if curve.size == 3:
        moved = {name: ends[name] @ Q for name in make.names}
        moved |= {name: L["R0"] @ moved[name] for name in ("R0", "R1")}
        if "inertia" in moved:
            moved["inertia"] = Q.T @ moved["inertia"]
        want = L["R0"] @ curve(t) @ Q, curve(t, 1) @ Q
    else:
        moved = ends | {name: L["A0"] @ ends[name] for name in ("A0", "A1")}
        moved |= {name: ends[name] @ L["R0"].T for name in ("d0_dot", "d1_dot")}
        want = L["A0"] @ curve(t), curve(t, 1)
    same = make(moved)
    assert off(same(t), want[0]) < 1e-10
    assert off(same(t, 1), want[1]) < 1e-9


def lasts_as_long_as_it_is_told(make):
    """Multiply the rates by T, make the curve on [0, 1], and retime it. The result must equal the
    curve of duration T."""
    if "duration" not in inspect.signature(make.function).parameters:
        return  # a curve without the parameter `duration` keeps its own duration
    ends, T = sample(3), np.array([0.5, 1, 1.5])
    curve = make(ends, duration=T)
    unit = make(ends | {name: ends[name] * T[:, None] ** power for name, power in RATES.items()})
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


def altered(name, change):
    """Return a function that makes projected cubics with a method replaced by `change`."""

    def make(R0, R1, w0, w1):
        curve = copy(cubic(R0, R1, w0, w1))
        right = getattr(curve.__class__, name)
        changed = {name: lambda self, *given: change(right, self, *given)}
        object.__setattr__(curve, "__class__", type("Altered", (curve.__class__,), changed))
        curve.__dict__.update(given=(R0, R1, w0, w1), known={})
        return curve

    return make


def scaled(order, by):
    return altered("__call__", lambda call, c, t, k=0: call(c, t, k) * (by if k == order else 1))


# For each clause of the contract, these functions make deliberately faulty curves, which this
# clause must detect.
CONTRACT = {
    meets_its_ends: {
        "end": lambda R0, R1, w0, w1: bezier(R0, R1 @ rb.exp_so3([0, 0, 1e-9]), w0, w1),
        "end velocity": lambda R0, R1, w0, w1: bezier(R0, R1, w0, 1.0000001 * w1),
        "velocities exchanged": lambda R0, R1, w0, w1: bezier(R0, R1, w1, w0),
    },
    has_the_derivatives_of_its_values: {
        "velocity": scaled(1, 1.00001),
        "acceleration lost": scaled(2, 0),
        "jerk": scaled(3, 1.001),
    },
    is_the_stack_of_its_members: {
        "wrong member": lambda R0, R1, w0, w1: bezier(R0, np.flip(R1, range(R1.ndim - 2)), w0, w1),
    },
    has_values_at_times_of_any_shape: {
        "wrong shape": altered("__call__", lambda call, c, t, k=0: call(c, np.ravel(t), k)),
    },
    takes_each_curve_at_its_own_times: {
        "wrong member": altered("at_own_times", lambda at, c, *given: at(c[:, ::-1], *given)),
    },
    is_indexed_as_an_array_is: {
        "wrong member": altered("__getitem__", lambda get, c, i: get(c, i if i != 0 else 1)),
    },
    keeps_and_changes_no_arguments: {
        "argument changed": lambda R0, R1, w0, w1: bezier(R0, R1, np.add(w0, 1e-9, out=w0), w1),
        "argument kept": altered("__call__", lambda call, c, *given: cubic(*c.given)(*given)),
        "result kept": altered(
            "__call__", lambda call, c, t, k=0: c.known.setdefault(k, call(c, t, k))
        ),
    },
    refuses_bad_arguments_by_name: {
        "unchecked": lambda R0, R1, w0, w1: bezier(R0, R1, np.nan_to_num(w0), w1),
    },
    refuses_bad_times_and_orders: {
        "unchecked": altered("__call__", lambda call, c, t, k=0: call(c, np.clip(t, 0, 1), k)),
    },
    is_the_same_after_pickling: {
        "other curve": altered("__reduce__", lambda _, c: (cubic, (*c.given[:3], c.given[2]))),
    },
    moves_with_its_ends: {
        "body's axes": lambda R0, R1, w0, w1: cubic(R0, R1, w0, w1 * [1, 1, 1.0001]),
        "room's axes": lambda R0, R1, w0, w1: cubic(R0, R1, w0, w1 + 1e-6 * R0[..., 0, :]),
    },
    lasts_as_long_as_it_is_told: {
        "unit of time": lambda R0, R1, w0, w1, *, duration=1.0: rb.retime(
            bezier(R0, R1, w0, w1), duration
        ),
    },
}


@pytest.mark.parametrize("make", MAKERS.values(), ids=MAKERS)
@pytest.mark.parametrize("clause", CONTRACT)
def test_a_curve_keeps_the_contract(make, clause):
    if clause is not refuses_bad_arguments_by_name or make.function in FUNCTIONS.values():
        clause(make)


def test_every_function_that_returns_a_curve_is_tested():
    assert set(FUNCTIONS) <= set(MAKERS) | NO_STACKS
    assert len(FUNCTIONS) >= 20


@pytest.mark.parametrize("clause", CONTRACT)
def test_each_fault_is_reported_under_the_clause_that_it_breaks(clause):
    for fault in CONTRACT[clause].values():
        with pytest.raises((AssertionError, ValueError, pytest.fail.Exception)):
            clause(of(fault))
