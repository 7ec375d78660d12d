"""Compare the times of this and other packages on the same tasks, for `course.py bench`."""
