"""Curves of rotations and poses, their costs and their timing.

`curve` has the class `Curve`. Curves between two poses are in `rigid`, `geodesics`, `projected`,
`bezier` and `closed`; curves through many poses are in `chain` and `velocities`.
`functionals` and `cost` have the costs, and `timing` has the fastest timing under limits.
"""
