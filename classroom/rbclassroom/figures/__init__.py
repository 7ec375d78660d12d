"""Figures of single lessons: each module has the tables, drawings and captions for a lesson."""

from collections.abc import Mapping

import numpy as np

from rbcourse import Array
from rbcourse.draw.save import Table


def columns(form: str, vectors: Mapping[str, Array], letters: str = "xyz") -> dict[str, Array]:
    """Return the components of vectors, shape (n, 2) or (n, 3), as columns of a table.

    `form` makes the name of a column from the names of a vector and of a component.
    """
    return {
        form.format(name, letter): column
        for name, vector in vectors.items()
        for letter, column in zip(letters, vector.T, strict=False)
    }


def vectors(form: str, data: Table, letters: str = "xyz") -> dict[str, Array]:
    """Return the vectors of a table that `columns` made, by name."""
    return {
        name: np.stack([data[form.format(name, letter)] for letter in letters], axis=-1)
        for name in named(form.format("", letters[0]), data)
    }


def named(ending: str, data: Table) -> dict[str, Array]:
    """Return the columns whose names end with `ending`; the keys are the names without `ending`."""
    return {
        name.removesuffix(ending): np.asarray(column)
        for name, column in data.items()
        if name.endswith(ending)
    }
