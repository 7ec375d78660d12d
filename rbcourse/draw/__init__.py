"""Pictures: artists on axes that the caller owns, and figures and animations as files."""

from rbcourse.draw.animate import save_animation
from rbcourse.draw.save import named_tables, save_figure, save_table

__all__ = ["named_tables", "save_animation", "save_figure", "save_table"]
