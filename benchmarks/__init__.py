"""Compare the times that rbcourse and other packages need for the same tasks."""
