"""Slides of the lessons, shown to a class: votes by phone, a speaker view, PDF, a crib."""
