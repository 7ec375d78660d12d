"""Compare the speed of rbcourse with other packages on the same tasks."""
