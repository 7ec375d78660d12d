"""A body turned by several laws: the torques that are drawn are those of mechanics."""

import matplotlib.pyplot as plt
import numpy as np
import pytest

import rbcourse as rb
from rbclassroom.figures import lesson13

G = rb.metrics.box_inertia([0.3, 0.2, 0.03])
ENDS = np.eye(3), rb.exp_so3([1.0, -0.7, 1.2]), np.array([1.0, 2, 0]), np.array([0, -1.0, 2])
WAYS = {
    "as if a ball": rb.minimum_acceleration_so3(*ENDS),
    "least acceleration": rb.minimum_acceleration_so3(*ENDS, G),
    "least torque": rb.minimum_torque_so3(*ENDS, G),
}
T = np.linspace(0, 1, 21)
TABLE = lesson13.torque_table(T, WAYS, G)


@pytest.fixture
def axes():
    fig, axes = plt.subplots(1, 3)
    yield axes
    plt.close(fig)


@pytest.mark.source("beyond BK 1")
@pytest.mark.parametrize("law", WAYS)
def test_the_torque_changes_the_angular_momentum_in_the_room(law):
    curve, h = WAYS[law], 1e-5
    inner = T[1:-1]

    def momentum(t):
        return (curve(t) @ G @ curve(t, 1)[..., None])[..., 0]

    changes = (momentum(inner + h) - momentum(inner - h)) / (2 * h)
    torque = lesson13.torques(curve, G, inner)
    off = np.abs((curve(inner) @ torque[..., None])[..., 0] - changes).max()
    assert off < 1e-7 * np.abs(torque).max()


def test_the_table_has_the_components(axes):
    assert list(TABLE)[:4] == ["t [s]", *(f"as if a ball {axis} [N m]" for axis in "xyz")]
    assert len(TABLE) == 10
    lines = lesson13.draw_torques(axes, TABLE)
    for k, (law, curve) in enumerate(WAYS.items()):
        torque = lesson13.torques(curve, G, T)
        assert axes[k].get_title() == law
        drawn = np.stack([line.get_ydata() for line in lines[4 * k : 4 * k + 3]], axis=-1)
        assert np.array_equal(drawn, torque)
        assert lines[4 * k + 3].get_ydata() == pytest.approx(np.linalg.norm(torque, axis=-1))
    said = lesson13.describe_torques(TABLE)
    largest = np.linalg.norm(lesson13.torques(WAYS["least torque"], G, T), axis=-1).max()
    assert f"least torque: at most {largest:.2g} N m" in said


def test_the_speeds_are_those_of_the_curves(axes):
    rest = np.zeros(3)
    ends = np.eye(3), rb.exp_so3([0, 0, 1.5]), rest, rest, rest, rest
    curves = {
        "least jerk": rb.minimum_jerk_so3(*ends),
        "projected quintic": rb.projected_quintic_so3(*ends),
    }
    table = lesson13.speed_table(T, curves)
    lines = lesson13.draw_speeds(axes[0], table)
    for line, curve in zip(lines, curves.values(), strict=True):
        assert line.get_xdata() == pytest.approx(T)
        assert line.get_ydata() == pytest.approx(np.linalg.norm(curve(T, 1), axis=-1))
    # 30 t² (1 − t)² of 1.5 rad: 1.875 times 1.5 at half time
    assert "least jerk at most 2.8" in lesson13.describe_speeds(table)
