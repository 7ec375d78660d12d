"""The explorers of the lessons: pictures that readers change with sliders."""

from rbclassroom.explorers.bodies import body_explorer
from rbclassroom.explorers.curves import flip_explorer, screw_explorer, theta_explorer
from rbclassroom.explorers.optima import cube_explorer, minimum_acceleration_explorer
from rbclassroom.explorers.paths import chain_explorer, spline_explorer
from rbclassroom.explorers.plane import arm_explorer, planar_explorer
from rbclassroom.explorers.rotations import projection_explorer, random_explorer, rotation_explorer
from rbclassroom.explorers.timing import timing_explorer

__all__ = [
    "arm_explorer",
    "body_explorer",
    "chain_explorer",
    "cube_explorer",
    "flip_explorer",
    "minimum_acceleration_explorer",
    "planar_explorer",
    "projection_explorer",
    "random_explorer",
    "rotation_explorer",
    "screw_explorer",
    "spline_explorer",
    "theta_explorer",
    "timing_explorer",
]
