"""Times of the package beside others, for the same tasks: `python3 course.py bench`."""
