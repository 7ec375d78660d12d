"""Python in the pages of the book: readers run cells of lessons and solve problem sets."""
