"""The contract of all makers of curves: one test for all of them, and faults that it finds."""

import inspect
import pickle
import typing
from copy import copy
from typing import NamedTuple

import numpy as np
import pytest

import rbcourse as rb


class Maker(NamedTuple):
    """A function that returns a curve, and the names of the arguments that it is called with."""

    function: typing.Callable
    names: tuple

    def __call__(self, ends):
        return self.function(**{name: ends[name] for name in self.names})


def of(function, *more):
    """The maker with the required arguments of a function, and `more`."""
    parameters = inspect.signature(function).parameters.values()
    return Maker(function, (*(p.name for p in parameters if p.default is p.empty), *more))


def squared(t, order):
    return (t * t, 2 * t, 2 + 0 * t, 0 * t)[order]


def returns_a_curve(function):
    kind = typing.get_type_hints(function)["return"]
    return inspect.isclass(kind) and issubclass(kind, rb.Curve)


FUNCTIONS = rb.CLOSED_FORMS | {
    name: function
    for name in rb.__all__
    if inspect.isfunction(function := getattr(rb, name)) and returns_a_curve(function)
}
DERIVED = {  # functions of curves, and of many poses
    "retime": Maker(lambda R0, R1: rb.retime(rb.geodesic_so3(R0, R1), 2.5), ("R0", "R1")),
    "stationary_so3": Maker(
        lambda **ends: rb.stationary_so3(rb.bezier_so3(**ends)), ("R0", "R1", "w0", "w1")
    ),
    "chain": None,  # no stacks
}
MAKERS = {
    **{name: of(function) for name, function in FUNCTIONS.items() if name not in DERIVED},
    **{name: make for name, make in DERIVED.items() if make},
    "minimum_acceleration_so3 of a body": of(rb.minimum_acceleration_so3, "inertia"),
    "minimum_acceleration_se3 of a body": of(rb.minimum_acceleration_se3, "inertia"),
    "projected_line_so3 with f": Maker(
        lambda R0, R1: rb.projected_line_so3(R0, R1, squared), ("R0", "R1")
    ),
    "retime of a projection": Maker(
        lambda **ends: rb.retime(rb.projected_cubic_so3(**ends), 0.5), ("R0", "R1", "w0", "w1")
    ),
}
every_maker = pytest.mark.parametrize("make", MAKERS.values(), ids=MAKERS)


def sample(*batch, seed=0):
    """Ends of all kinds: turns of up to 2 rad, moderate velocities and accelerations."""
    rng = np.random.default_rng([92, seed])
    R0, Q = rb.sample_rotation((2, *batch), rng=rng)
    R1 = R0 @ rb.exp_so3(rng.uniform(-1.15, 1.15, (*batch, 3)))
    w0, w1, a0, a1, d0, d1, v0, v1 = rng.uniform(-2, 2, (8, *batch, 3))
    G = Q @ (rng.uniform(1, 1.9, (*batch, 3, 1)) * Q.mT)
    A0, A1 = rb.pose_from_components(R0, d0), rb.pose_from_components(R1, d1)
    names = ["R0", "R1", "w0", "w1", "a0", "a1", "inertia", "A0", "A1", "d0_dot", "d1_dot"]
    values = R0, R1, w0, w1, a0, a1, (G + G.mT) / 2, A0, A1, v0, v1
    return dict(zip(names, values, strict=True))


def orders(curve):
    return range(4 if curve.size == 3 else 3)


def core(curve, order):
    return (curve.size, curve.size) if order == 0 else (3 * curve.size - 6,)


def times(curve, *shape):
    start, end = curve.domain
    end = min(end, start + 3)  # an empty stack has all times
    inside = np.random.default_rng(93).random(shape)
    return start + (end - start) * inside


def off(a, b):
    """The largest difference, over the largest entry or 1."""
    return np.abs(np.subtract(a, b, dtype=float)).max(initial=0) / max(1, np.abs(b).max(initial=0))


def meets_its_ends(make):
    """The rotations or poses, the velocities and the accelerations are those asked for."""
    ends = sample(4)
    curve = make(ends)
    for k, t in enumerate(curve.domain):
        value = ends[f"{'RA'[curve.size - 3]}{k}"]
        assert off(curve(t), value) < 1e-13
        for order, name in ((1, f"w{k}"), (2, f"a{k}")):
            if name in make.names and "retime" not in name_of(make):
                assert off(curve(t, order)[..., :3], ends[name]) < 1e-11
        if f"d{k}_dot" in make.names:
            moved = (value[..., :3, :3] @ curve(t, 1)[..., 3:, None])[..., 0]
            assert off(moved, ends[f"d{k}_dot"]) < 1e-12


def name_of(make):
    return next((name for name, one in MAKERS.items() if one is make), "")


def slope(f, t, h=0.01):
    """f'(t) by the central difference of eighth order."""
    weights = np.array([1 / 280, -4 / 105, 1 / 5, -4 / 5])
    weights = np.array([*weights, 0, *-weights[::-1]]) / h
    return np.tensordot(weights, [f(t + k * h) for k in range(-4, 5)], axes=1)


def has_the_derivatives_of_its_values(make):
    """As `Curve` says: R' = R ŵ, w', w''; on SE(3) Rᵀ d' and Rᵀ d''."""
    curve = make(sample(3))
    start, end = curve.domain
    h = 0.005 * (end - start)
    for t in start + (end - start) * np.array([0.1, 0.37, 0.8]):
        R, moving = curve(t)[..., :3, :3], slope(curve, t, h)
        w = rb.vee_so3(R.mT @ moving[..., :3, :3])
        assert off(curve(t, 1)[..., :3], w) < 1e-8
        for order in list(orders(curve))[2:]:
            faster = slope(lambda t, below=order - 1: curve(t, below)[..., :3], t, h)
            assert off(curve(t, order)[..., :3], faster) < 1e-8
        if curve.size == 4:
            assert off(curve(t, 1)[..., 3:], (R.mT @ moving[..., :3, 3:])[..., 0]) < 1e-8
            path = slope(lambda t: curve(t)[..., :3, :3] @ curve(t, 1)[..., 3:, None], t, h)
            assert off(curve(t, 2)[..., 3:], (R.mT @ path)[..., 0]) < 1e-8


def is_the_stack_of_its_members(make):
    """Shapes are times, stack, core; every member is the single curve; ends broadcast."""
    ends = sample(2, 3)
    stack = make(ends)
    assert stack.batch_shape == (2, 3)
    t = times(stack, 5)
    for i in np.ndindex(2, 3):
        one = make({name: value[i] for name, value in ends.items()})
        assert one.batch_shape == ()
        for order in orders(stack):
            want = one(t, order)
            assert want.shape == (5, *core(stack, order))
            assert off(stack(t, order)[:, *i], want) < 1e-11
            assert off(stack[i](t, order), want) < 1e-11
    first = {name: value[0, 0] if name[1] == "0" else value for name, value in ends.items()}
    some = make(first)
    last = make({name: value if name[1] == "0" else value[1, 2] for name, value in first.items()})
    assert off(some(t)[:, 1, 2], last(t)) < 1e-11


def has_values_at_times_of_any_shape(make):
    """Also at none, at more than are evaluated together, and for an empty stack."""
    for batch in ((), (2,), (0,), (2, 0)):
        curve = make(sample(*batch))
        for shape in ((), (0,), (7,), (2, 3)):
            t = times(curve, *shape)
            for order in orders(curve):
                values = curve(t, order)
                assert values.shape == (*shape, *batch, *core(curve, order))
                assert np.array_equal(values.reshape(-1), curve(t.ravel(), order).reshape(-1))
    curve = make(sample(2))
    t = times(curve, 5000)
    for order in orders(curve):
        pieces = [curve(part, order) for part in np.split(t, [1, 40, 2000])]
        assert off(curve(t, order), np.concatenate(pieces)) < 1e-12
    many = curve[np.arange(5001) % 2]
    for order in orders(curve):
        assert (
            off(many(t[:2], order)[:, [0, 4095, 4097, 5000]], curve(t[:2], order)[:, [0, 1, 1, 0]])
            < 1e-12
        )


def takes_each_curve_at_its_own_times(make):
    stack = make(sample(2, 3))
    t = times(stack, 4, 2, 3)
    for order in orders(stack):
        values = stack.at_own_times(t, order)
        assert values.shape == (4, 2, 3, *core(stack, order))
        for i in np.ndindex(2, 3):
            assert off(values[:, *i], stack(t[:, *i], order)[:, *i]) < 1e-12
    for shape in ((), (3,), (3, 2), (2, 3, 1)):
        with pytest.raises(ValueError, match=r"^t: shape .* wanted, got"):
            stack.at_own_times(np.zeros(shape))


INDICES = [
    (1, 2),
    0,
    (slice(None), -1),
    ...,
    np.array([[True, False, True], [False, False, True]]),
    ([1, 0, 1], [2, 2, 0]),
    np.s_[:0],
    (None, 1, slice(1, None)),
]


def is_indexed_as_an_array_is(make):
    """With the attributes that describe its curves."""
    stack = make(sample(2, 3))
    t = times(stack, 3)
    told = "margin", "margin_time", "converged", "nodes", "c", "cost", "rotation_vector", "twist"
    for index in INDICES:
        numbers = np.arange(6).reshape(2, 3)[index]
        some = stack[index]
        assert some.batch_shape == numbers.shape
        for order in orders(stack):
            want = stack(t, order).reshape(3, 6, *core(stack, order))[:, numbers]
            assert off(some(t, order), want) < 1e-12
        for name in told:
            if hasattr(stack, name):
                assert off(getattr(some, name), np.asarray(getattr(stack, name))[index]) < 1e-12
    assert [one.batch_shape for one in stack] == [(3,), (3,)]
    with pytest.raises(IndexError):
        stack[2]
    with pytest.raises(TypeError, match="a single curve"):
        stack[0, 0][0]


def keeps_and_changes_no_arguments(make):
    """Ends, times and returned arrays are independent of the curve."""
    ends = sample(2)
    before = {name: value.copy() for name, value in ends.items()}
    curve = make(ends)
    t = times(curve, 3)
    asked = t.copy()
    values = [curve(t, order) for order in orders(curve)]
    assert all(np.array_equal(ends[name], before[name]) for name in ends)
    assert np.array_equal(t, asked)
    for value in ends.values():
        value.fill(np.nan)
    first = [value.copy() for value in values]
    for value in values:
        value.fill(np.nan)
    assert all(np.array_equal(curve(t, k), first[k]) for k in orders(curve))


def refuses_bad_arguments_by_name(make):
    for name in make.names:
        for bad in (np.nan, 1j, "a"):
            ends = sample(2)
            ends[name] = ends[name].astype(object if isinstance(bad, str) else type(bad))
            ends[name][(1,) + (0,) * (ends[name].ndim - 1)] = bad
            with pytest.raises(ValueError, match=rf"^{name}"):
                make(ends)
        for shape in ((), (2,), (2, 4), (2, 3, 2), (2, 5, 5)):
            with pytest.raises(ValueError, match=rf"^{name}"):
                make({**sample(2), name: np.zeros(shape)})
        ragged = [[[1.0, 0, 0], [0, 1]]]
        masked = np.ma.masked_less(sample(2)[name], 0)
        for bad in (ragged, masked):
            with pytest.raises(ValueError, match=rf"^{name}"):
                make({**sample(2), name: bad})
        if len(make.names) > 1:
            with pytest.raises(ValueError, match=name):
                make({**sample(2), name: sample(3)[name]})


def refuses_bad_times_and_orders(make):
    curve = make(sample(2))
    start, end = curve.domain
    for t in (start - 1e-6, end + 1e-6, np.nan, np.inf, [start, np.nan], "a", 1j):
        with pytest.raises(ValueError, match=r"^t"):
            curve(t)
    for order in (-1, len(orders(curve)), 1.0, True, "1"):
        with pytest.raises(ValueError, match=r"^order"):
            curve(start, order)


def is_the_same_after_pickling(make):
    curve = make(sample(2))
    again = pickle.loads(pickle.dumps(curve))
    t = times(curve, 3)
    assert all(np.array_equal(again(t, order), curve(t, order)) for order in orders(curve))
    assert repr(again) == repr(curve)
    assert f"on S{'OE'[curve.size - 3]}({curve.size - (curve.size == 4)})" in repr(curve)


def moves_with_its_ends(make):
    """L A(t) for the poses L A0 and L A1; on SO(3) L R(t) Q for the ends and the inertia moved."""
    ends = sample(2)
    L, Q = sample(seed=1), sample(seed=2)["R0"]
    curve = make(ends)
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
    assert off(make(moved)(t), want[0]) < 1e-10
    assert off(make(moved)(t, 1), want[1]) < 1e-9


RATES = {"w0": 1, "w1": 1, "d0_dot": 1, "d1_dot": 1, "a0": 2, "a1": 2}


def lasts_as_long_as_it_is_told(make):
    """One duration for each: the curve from 0 to 1 whose rates at the ends are as many times."""
    if "duration" not in inspect.signature(make.function).parameters:
        pytest.skip("it has the duration of its curve, or takes it in a test of its own")
    ends, T = sample(3), np.array([0.5, 1, 3])
    curve = make.function(**{name: ends[name] for name in make.names}, duration=T)
    scaled_ends = {
        name: value * (T[:, None] ** RATES[name] if name in RATES else 1)
        for name, value in ends.items()
    }
    unit = make(scaled_ends)
    assert np.array_equal(curve.duration, T)
    assert curve.domain == (0, 0.5)
    t = np.random.default_rng(94).random((4, 3))
    for same in (curve, rb.retime(unit, T)):
        for order in orders(curve):
            scale = T.reshape(3, *(1 for _ in core(curve, order))) ** order
            want = unit.at_own_times(t, order) / scale
            assert off(same.at_own_times(t * T, order), want) < 1e-11
    assert off(curve[2](3 * t[:, 2]), curve.at_own_times(t * T)[:, 2]) < 1e-12
    for bad in (0, -1, np.nan, 1e-200, "a", [1, 2]):
        with pytest.raises(ValueError, match="duration"):
            make.function(**{name: ends[name] for name in make.names}, duration=bad)


CONTRACT = [
    meets_its_ends,
    has_the_derivatives_of_its_values,
    is_the_stack_of_its_members,
    has_values_at_times_of_any_shape,
    takes_each_curve_at_its_own_times,
    is_indexed_as_an_array_is,
    keeps_and_changes_no_arguments,
    refuses_bad_arguments_by_name,
    refuses_bad_times_and_orders,
    is_the_same_after_pickling,
    moves_with_its_ends,
    lasts_as_long_as_it_is_told,
]


@every_maker
@pytest.mark.parametrize("clause", CONTRACT)
def test_a_curve(make, clause):
    if clause is refuses_bad_arguments_by_name and make.function not in FUNCTIONS.values():
        pytest.skip("the arguments are those of another maker")
    clause(make)


def test_every_function_that_returns_a_curve_has_a_maker():
    assert set(FUNCTIONS) <= set(MAKERS) | {"chain"}
    assert len(FUNCTIONS) >= 20


class Keeping(rb.Curve):
    """A geodesic that keeps its arguments, and gives them away."""

    def __init__(self, R0, R1):
        super().__init__(duration=np.ones(np.shape(R0)[:-2]))
        self.R0, self.R1 = R0, R1

    def __call__(self, t, order=0):
        return rb.geodesic_so3(self.R0, self.R1)(t, order)


class Fixed(rb.Curve):
    """A geodesic that returns the same array again."""

    def __init__(self, R0, R1):
        self.curve, self.known = rb.geodesic_so3(R0, R1), {}
        super().__init__(duration=self.curve.duration)

    def __call__(self, t, order=0):
        return self.known.setdefault(order, self.curve(t, order))


def altered(**methods):
    """The maker of projected cubics with other methods, each a function of the right one."""

    def make(R0, R1, w0, w1):
        curve = copy(rb.projected_cubic_so3(R0, R1, w0, w1))
        right = type(curve)
        changed = {name: change(getattr(right, name)) for name, change in methods.items()}
        object.__setattr__(curve, "__class__", type("Altered", (right,), changed))
        return curve

    return make


def scaled(order, factor):
    return lambda call: lambda self, t, k=0: call(self, t, k) * (factor if k == order else 1)


def in_place(R0, R1, w0, w1):
    w0 *= 1 + 1e-9
    return rb.bezier_so3(R0, R1, w0, w1)


def other_member(R0, R1, w0, w1):
    R1 = np.roll(R1, 1, axis=0) if np.ndim(R1) > 2 else R1
    return rb.bezier_so3(R0, R1, w0, w1)


FAULTS = {
    "an end that is missed": (
        lambda R0, R1, w0, w1: rb.bezier_so3(R0, R1 @ rb.exp_so3([0, 0, 1e-9]), w0, w1),
        meets_its_ends,
    ),
    "an end velocity that is missed": (
        lambda R0, R1, w0, w1: rb.bezier_so3(R0, R1, w0, 1.0000001 * np.asarray(w1)),
        meets_its_ends,
    ),
    "velocities exchanged": (
        lambda R0, R1, w0, w1: rb.bezier_so3(R0, R1, w1, w0),
        meets_its_ends,
    ),
    "a velocity off": (altered(__call__=scaled(1, 1.00001)), has_the_derivatives_of_its_values),
    "an acceleration lost": (altered(__call__=scaled(2, 0)), has_the_derivatives_of_its_values),
    "a jerk off": (altered(__call__=scaled(3, 1.001)), has_the_derivatives_of_its_values),
    "the wrong member of a stack": (other_member, is_the_stack_of_its_members),
    "the wrong member at its own time": (
        altered(
            at_own_times=lambda right: lambda self, t, k=0: right(self[:, ::-1], t, k),
        ),
        takes_each_curve_at_its_own_times,
    ),
    "the wrong member by an index": (
        altered(__getitem__=lambda right: lambda self, i: right(self, i if i != 0 else 1)),
        is_indexed_as_an_array_is,
    ),
    "times of the wrong shape": (
        altered(__call__=lambda right: lambda self, t, k=0: right(self, np.ravel(t), k)),
        has_values_at_times_of_any_shape,
    ),
    "an argument changed": (in_place, keeps_and_changes_no_arguments),
    "an argument kept": (Keeping, keeps_and_changes_no_arguments),
    "a result kept": (Fixed, keeps_and_changes_no_arguments),
    "an argument not checked": (
        lambda R0, R1, w0, w1: rb.bezier_so3(R0, R1, np.nan_to_num(w0), w1),
        refuses_bad_arguments_by_name,
    ),
    "a time not checked": (
        altered(__call__=lambda right: lambda self, t, k=0: right(self, np.clip(t, 0, 1), k)),
        refuses_bad_times_and_orders,
    ),
    "what is lost by a pickle": (
        altered(__reduce__=lambda _: lambda self: (rb.projected_cubic_so3, ENDS_OF_A_PICKLE)),
        is_the_same_after_pickling,
    ),
    "a curve that depends on the body's axes": (
        lambda R0, R1, w0, w1: rb.projected_cubic_so3(R0, R1, w0, np.multiply(w1, [1, 1, 1.0001])),
        moves_with_its_ends,
    ),
    "a curve that depends on the room": (
        lambda R0, R1, w0, w1: rb.projected_cubic_so3(
            R0, R1, w0, np.asarray(w1) + 1e-6 * np.asarray(R0)[..., 0, :]
        ),
        moves_with_its_ends,
    ),
}
FAULTS["velocities that are not per unit of the duration"] = (
    lambda R0, R1, w0, w1, *, duration=1.0: rb.retime(rb.bezier_so3(R0, R1, w0, w1), duration),
    lasts_as_long_as_it_is_told,
)
ENDS_OF_A_PICKLE = tuple(sample(2, seed=3)[name] for name in ("R0", "R1", "w0", "w1"))


@pytest.mark.parametrize("fault", FAULTS)
def test_the_contract_finds(fault):
    function, clause = FAULTS[fault]
    with pytest.raises((AssertionError, ValueError, pytest.fail.Exception)):
        clause(of(function))
