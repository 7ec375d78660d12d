"""What things take, side by side with what one would use instead: `python3 course.py bench`."""
