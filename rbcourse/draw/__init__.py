"""Pictures: artists on the caller's axes, and figures and animations as files."""

from pathlib import Path

from matplotlib import font_manager

from rbcourse.draw.animate import save_animation
from rbcourse.draw.motions import profiles
from rbcourse.draw.save import described, named_tables, save_figure, save_table

font_manager.fontManager.addfont(Path(__file__).with_name("CourseSans.ttf"))  # for the styles

__all__ = ["described", "named_tables", "profiles", "save_animation", "save_figure", "save_table"]
