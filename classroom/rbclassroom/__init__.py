"""The classroom of rbcourse: explorers, an atlas, lessons, lectures, problem sets and the book.

This package uses only the names that `rbcourse` exports.
"""

__version__ = "2.0.0"
