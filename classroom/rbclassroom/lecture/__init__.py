"""Slides of the lessons for a class.

- `slides` reads a lesson and the texts of its slides, ``notebooks/slides/06.md``;
- `deck` makes pages of slides, and the crib sheet;
- `serve` shows them, with `votes` by phone; `pdf` prints them;
- `sketches` computes the curves in the drawings, ``notebooks/slides/06.svg``.
"""
