"""Python in the pages of the book, for cells of lessons and for problem sets."""
