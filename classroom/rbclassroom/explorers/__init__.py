"""The explorers of the lessons: pictures that readers change with sliders.

| lesson | explorer | | lesson | explorer |
|---|---|---|---|---|
| 01 | `planar` | | 08 | `flip` |
| 02 | `arm` | | 09, 11, 12 | `minimum_acceleration` |
| 00, 03 | `rotation` | | 10 | `cube` |
| 03 | `interpolation` | | 13 | `body` |
| 03 | `double_cover` | | 14 | `spline` |
| 04 | `projection` | | 15 | `timing` |
| 05 | `random` | | 16 | `smoothing` |
| 06 | `theta` | | 17 | `chain` |
| 07 | `screw` | | | |
"""

from rbclassroom.explorers.curves import flip_explorer, screw_explorer, theta_explorer
from rbclassroom.explorers.interpolation import double_cover_explorer, interpolation_explorer
from rbclassroom.explorers.optima import body_explorer, cube_explorer, minimum_acceleration_explorer
from rbclassroom.explorers.paths import chain_explorer, spline_explorer, timing_explorer
from rbclassroom.explorers.plane import arm_explorer, planar_explorer
from rbclassroom.explorers.rotations import projection_explorer, random_explorer, rotation_explorer
from rbclassroom.explorers.smoothing import smoothing_explorer

__all__ = [
    "arm_explorer",
    "body_explorer",
    "chain_explorer",
    "cube_explorer",
    "double_cover_explorer",
    "flip_explorer",
    "interpolation_explorer",
    "minimum_acceleration_explorer",
    "planar_explorer",
    "projection_explorer",
    "random_explorer",
    "rotation_explorer",
    "screw_explorer",
    "smoothing_explorer",
    "spline_explorer",
    "theta_explorer",
    "timing_explorer",
]
