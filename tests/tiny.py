"""A course of one small lesson, and how Python runs a module in it."""

import sys

import nbformat
from nbformat.v4 import new_notebook

MODULE = [sys.executable, "-m"]


def lesson_at(folder, *cells):
    """Write a lesson of these cells into the course of a folder; return its path."""
    (folder / "notebooks").mkdir()
    path = folder / "notebooks" / "01_tiny.ipynb"
    path.write_text(nbformat.writes(new_notebook(cells=list(cells))), encoding="utf-8")
    return path
