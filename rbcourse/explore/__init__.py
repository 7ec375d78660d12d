"""The explorers: for each lesson a picture that follows its sliders."""

from rbcourse.explore.bodies import body_explorer
from rbcourse.explore.curves import flip_explorer, screw_explorer, theta_explorer
from rbcourse.explore.optima import cube_explorer, minimum_acceleration_explorer
from rbcourse.explore.paths import chain_explorer
from rbcourse.explore.plane import arm_explorer, planar_explorer
from rbcourse.explore.rotations import projection_explorer, random_explorer, rotation_explorer

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
    "theta_explorer",
]
