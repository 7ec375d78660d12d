"""Figures that only one lesson shows: a module for each lesson has tables, drawings, captions."""

from collections.abc import Mapping

import numpy as np

from rbcourse import Array
from rbcourse.draw.save import Table


def columns(form: str, vectors: Mapping[str, Array], letters: str = "xyz") -> dict[str, Array]:
    """Return vectors, shape (n, 2) or (n, 3), as columns with names such as "{} {} [m]"."""
    return {
        form.format(name, letter): column
        for name, vector in vectors.items()
        for letter, column in zip(letters, vector.T, strict=False)
    }


def vectors(form: str, data: Table, letters: str = "xyz") -> dict[str, Array]:
    """Return the vectors of a table made by `columns`, shape (n, len(letters)), by name."""
    return {
        name: np.stack([data[form.format(name, letter)] for letter in letters], axis=-1)
        for name in named(form.format("", letters[0]), data)
    }


def named(ending: str, data: Table) -> dict[str, Array]:
    """Return the columns whose names have this ending, by the rest of their names."""
    return {
        name.removesuffix(ending): np.asarray(column)
        for name, column in data.items()
        if name.endswith(ending)
    }
