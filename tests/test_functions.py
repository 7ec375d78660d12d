"""Test the contract of all functions of arrays: shapes, stacks and errors."""

import importlib
import inspect
import json
import pkgutil
import re
from copy import deepcopy
from pathlib import Path

import numpy as np
import pytest
from quick import stored_notebooks

import rbcourse as rb

ROOT = Path(__file__).parents[1]
ENTRY = re.compile(r"^(\w+(?:, \w+)*) : array_like, shape \(([^()]*)\)(, optional)?$", re.MULTILINE)
RESULT = re.compile(r"^Returns\n-+\nndarray(?: of bool)?, shape \(([^()]*)\)$", re.MULTILINE)
SIZES = {"n": 3, "m": 3, "n + 1": 4, "steps + 1": 11}
TURNS = {"R", "R0", "R1", "S"}


def exported():
    """Return all functions that the package and its modules export, by name."""
    others = {"__main__", "draw", "paper", "report", "textbook"}
    names = {part.name for part in pkgutil.iter_modules(rb.__path__)} - others
    modules = [rb, *(importlib.import_module(f"rbcourse.{name}") for name in sorted(names))]
    listed = {name: getattr(m, name) for m in modules for name in getattr(m, "__all__", ())}
    return {name: one for name, one in listed.items() if inspect.isfunction(one)}


def arrays_of(function):
    """Return the core shapes of the required arrays, as the docstring states them."""
    found = {}
    for names, shape, optional in ENTRY.findall(inspect.getdoc(function)):
        if shape.startswith("...") and not optional:
            found |= dict.fromkeys(names.split(", "), shape.split(", ")[1:])
    return found


def takes_arrays_alone(function):
    parameters = inspect.signature(function).parameters.values()
    needed = {one.name for one in parameters if one.default is one.empty}
    found, doc = arrays_of(function), inspect.getdoc(function)
    if any("n" in shape for _, shape, optional in ENTRY.findall(doc) if optional):
        return False  # the default has another n
    return bool(needed) and set(found) == needed and RESULT.search(doc)


FUNCTIONS = {name: one for name, one in exported().items() if takes_arrays_alone(one)}
every_function = pytest.mark.parametrize("function", FUNCTIONS.values(), ids=FUNCTIONS)


def sample(function, *batch):
    """Return valid arguments: rotations and poses, unit quaternions, inertias, or any numbers."""
    rng, found = np.random.default_rng([96, *batch]), {}
    for name, core in arrays_of(function).items():
        sizes = tuple(int(SIZES.get(n, n)) for n in core)
        R = rb.sample_rotation(batch, rng=rng)
        if sizes == (4, 4):
            found[name] = rb.pose_from_components(R, rng.normal(size=(*batch, 3)))
        elif sizes == (4,):
            found[name] = rb.quaternion_from_matrix(R)
        elif name in ("G", "W") and function is not rb.vee_so3:
            G = R @ (np.array([2.0, 3, 4])[:, None] * R.mT)
            found[name] = (G + G.mT) / 2
        elif sizes == (3, 3):
            found[name] = R if name in TURNS else R + 0.1 * rng.normal(size=R.shape)
        else:
            found[name] = rng.uniform(0.5, 0.9, (*batch, *sizes))
    return found


@every_function
def test_results_have_the_documented_shape(function):
    (shape,) = RESULT.search(inspect.getdoc(function)).groups()
    before, _, core = shape.rpartition("...")
    leading = tuple(SIZES[n] for n in before.split(", ") if n)
    for batch in ((), (2,), (5, 7), (0,), (2, 0)):  # no other axes have the lengths 5 and 7
        given = sample(function, *batch)
        values = function(**given)
        sizes = tuple(int(SIZES.get(n, n)) for n in core.split(", ") if n)
        assert values.shape == (*leading, *batch, *sizes)
        for i in np.ndindex(batch):
            one = function(**{name: value[i] for name, value in given.items()})
            some = values[(slice(None),) * len(leading) + i]
            assert np.allclose(some, one, rtol=1e-12, atol=1e-12)


@every_function
def test_large_stacks_give_the_results_of_small_ones(function):
    """Some functions divide stacks of more than 1,024 arguments."""
    (shape,) = RESULT.search(inspect.getdoc(function)).groups()
    axis = len([n for n in shape.rpartition("...")[0].split(", ") if n])
    given = sample(function, 2, 700)
    parts = [
        function(**{name: value[:, part] for name, value in given.items()})
        for part in (slice(0, 400), slice(400, 700))
    ]
    wanted = np.concatenate(parts, axis=axis + 1)
    assert np.allclose(function(**given), wanted, rtol=1e-12, atol=1e-12)


@every_function
def test_batches_of_arguments_broadcast(function):
    given = sample(function, 2, 3)
    for name in given:
        first = given | {name: given[name][0]}
        both = given | {name: np.stack([given[name][0]] * 2)}
        assert np.allclose(function(**first), function(**both), rtol=1e-12, atol=1e-12)
        if len(given) > 1:
            with pytest.raises(ValueError, match=rf"broadcast.*\b{name} \(5,\)|^{name}"):
                function(**given | {name: sample(function, 5)[name]})


@every_function
def test_arguments_are_neither_changed_nor_returned(function):
    given = sample(function, 2)
    before = deepcopy(given)
    values = function(**given)
    assert all(np.array_equal(given[name], before[name]) for name in given)
    kept = values.copy()
    for value in given.values():
        value.fill(0)
    assert np.array_equal(values, kept)


@every_function
def test_errors_name_the_bad_argument(function):
    for name, core in arrays_of(function).items():
        given = sample(function, 2)
        shapes = [()] * len(core[:1]) + [(2, 5, 7)] * len(core[1:])
        shapes += [(2, 7)] * (not {"n", "m"} & set(core) and len(core) > 0)
        bad = [np.zeros(shape) for shape in shapes]
        good = given[name]
        bad += [[[1.0, 0, 0], [0, 1]], np.ma.masked_greater(good, 0), good + 1j, good.astype(str)]
        if not function.__name__.startswith("is_"):
            bad += [np.where(good == good.flat[0], x, good) for x in (np.nan, np.inf)]
        for one in bad:
            with pytest.raises(ValueError, match=rf"^{name}\b"):
                function(**given | {name: one})


def sections_of(docstring):
    """Return the sections of a docstring by their headings."""
    parts = re.split(r"^(\w.*)\n-{3,}\n", docstring + "\n", flags=re.MULTILINE)
    return dict(zip(parts[1::2], parts[2::2], strict=True))


def described(docstring):
    """Yield the name, the type and the description of each parameter."""
    text = sections_of(docstring).get("Parameters", "")
    for head, lines in re.findall(r"^(\S.*)\n((?:(?: +.*)?\n)*)", text, re.MULTILINE):
        names, _, kind = head.partition(" : ")
        yield from ((name.strip(" *"), kind, lines.strip()) for name in names.split(","))


def public():
    """Return the functions of public modules, and the methods of `Curve` and `Body`, by name."""
    modules = [rb, *(importlib.import_module(f"rbcourse.{name}") for name in sorted(rb._MODULES))]
    found = {f"{m.__name__}.{name}": getattr(m, name) for m in modules for name in m.__all__}
    for kind in (rb.Curve, rb.Body):
        methods = [name for name in vars(kind) if name[0] != "_" or name == "__call__"]
        found |= {f"{kind.__name__}.{name}": getattr(kind, name) for name in methods}
    functions = {
        name: one for name, one in found.items() if inspect.isfunction(one) or inspect.ismethod(one)
    }
    return functions | {"rbcourse.Body": rb.Body}


PUBLIC = public()


@pytest.mark.parametrize("name", PUBLIC)
def test_help_describes_each_parameter(name):
    """An entry has the type or the shape. No entry refers the reader to another function."""
    function = PUBLIC[name]
    text = inspect.getdoc(function)
    given = list(described(text))
    wanted = [one for one in inspect.signature(function).parameters if one != "self"]
    assert sorted(one for one, *_ in given) == sorted(wanted)
    assert [one for one, kind, lines in given if not kind or not lines] == []
    assert "As for" not in text


@pytest.mark.parametrize("name", exported())
def test_results_and_examples_are_documented(name):
    function = exported()[name]
    sections = sections_of(inspect.getdoc(function))
    assert "Returns" in sections or inspect.signature(function).return_annotation == "None"
    # all four functions share one example
    assert "Examples" in sections or function.__module__ == "rbcourse.files"


def test_the_package_exports_few_names():
    """The group decides for most functions; names of a group have a suffix if its field has it."""
    assert len(rb.__all__) <= 64
    usual = r"(hat|vee|exp|log|right_jacobian|right_jacobian_inverse|adjoint|inverse)_s[oe]3"
    suffixed = [name for name in rb.__all__ if re.fullmatch(r".*_s[oe]3", name)]
    assert len([name for name in suffixed if not re.fullmatch(usual, name)]) <= 8


def lines_for_users():
    """Yield the README, and the text and the code of all lessons and problem sets."""
    yield (ROOT / "README.md").read_text("utf-8")
    for path in stored_notebooks():
        cells = json.loads(path.read_text("utf-8"))["cells"]
        yield from ("".join(cell["source"]) for cell in cells)


def test_the_readme_a_lesson_or_a_problem_set_uses_each_exported_name():
    text = "\n".join(lines_for_users())
    uses = r"(\brb\.|`|^from rbcourse import .*\b){}\b"
    used = {name for name in rb.__all__ if re.search(uses.format(name), text, re.MULTILINE)}
    assert sorted(set(rb.__all__) - used) == []


def test_most_exported_functions_are_tested_here():
    assert len(FUNCTIONS) >= 55


def test_exported_arrays_are_read_only():
    arrays = [
        rb.connection.BASIS_SO3,
        rb.connection.BASIS_SE3,
        rb.metrics.METRIC_SO3,
        rb.metrics.METRIC_SE3,
    ]
    assert not any(array.flags.writeable for array in arrays)
