"""Lessons: run and stored, shown to a class, and indexed by equation."""
