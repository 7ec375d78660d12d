"""Compare times of the package with those of others on the same tasks: `course.py bench`."""
