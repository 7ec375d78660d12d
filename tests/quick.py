"""The choice of the tests that .ci/run leaves out."""

from pathlib import Path

import pytest

NOTEBOOKS = Path(__file__).parents[1] / "notebooks"


def quick_for(names, values):
    """Return values, or paths, as parameters of a test. Names of lessons have two digits. All are
    slow whose names are not among `names`."""
    params = []
    for value in values:
        name = value.stem[:2] if isinstance(value, Path) else value
        marks = [] if name in names else pytest.mark.slow
        params.append(pytest.param(value, id=name, marks=marks))
    return params


def stored_notebooks():
    """Return the lessons and the problem sets, without the work of students and lecturers."""
    return sorted([*NOTEBOOKS.glob("*.ipynb"), *NOTEBOOKS.glob("assignments/source/*/*.ipynb")])
