"""Python in the pages of the book: cells of lessons to edit and run, problem sets to solve."""
