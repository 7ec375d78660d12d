"""Slides of the lessons for a class: votes by phone, a speaker view, a PDF and a crib sheet."""
