"""Test bodies, the names of version 1, and the descriptions of curves."""

import pickle
import re
from copy import copy, deepcopy
from functools import reduce
from xml.etree import ElementTree

import numpy as np
import pytest

import rbcourse as rb
from rbcourse._migration import RENAMED

G, MASS, CENTRE = np.array([[2.0, 0.1, 0], [0.1, 2.5, 0.2], [0, 0.2, 3]]), 1.5, [0.1, -0.2, 0.3]
BODY = rb.Body(G, MASS, CENTRE)
A, X = rb.pose_from_coordinates([[0.3, 0.4, 1, 1, 2, -1], [1, 0.5, -0.4, 0.3, 0.2, 0.1]])


THIN = r"body.inertia\[1\] has the principal moments 1, 1, 3; each"


def parts(body):
    return [*np.ravel(body.inertia), body.mass, *body.centre]


def test_a_body_cannot_be_changed():
    """It neither keeps its arguments nor gives away its arrays."""
    inertia, centre = G.copy(), np.array(CENTRE)
    body, want = rb.Body(inertia, MASS, centre), parts(BODY)
    inertia[...] = centre[...] = 9
    for name in ("inertia", "mass", "centre", "colour"):
        with pytest.raises(AttributeError, match=f"a Body is immutable: {name} cannot be changed"):
            setattr(body, name, 9)
    for array in (body.inertia, body.centre):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 9
    assert parts(body) == want
    for other in (copy(body), deepcopy(body), pickle.loads(pickle.dumps(body))):
        assert parts(other) == want
        with pytest.raises(AttributeError, match="immutable"):
            other.mass = 9


def test_the_ball_is_the_body_of_the_metrics():
    ball = rb.Body.ball()
    assert np.array_equal(2 * np.eye(3), rb.metrics.METRIC_SO3)
    assert parts(ball) == [*np.ravel(rb.metrics.METRIC_SO3), 1, 0, 0, 0]
    assert ball.is_ball
    assert pickle.loads(pickle.dumps(ball)).is_ball
    assert not rb.Body(2.1 * np.eye(3)).is_ball
    assert rb.geodesic(A, X).body is rb.projected_cubic(A, X).body is ball
    assert rb.Body(G).mass == rb.Body.box([1, 2, 3]).mass == 1


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: rb.Body([1, 2, 3]), r"inertia: a matrix is wanted, such as np.diag"),
        (lambda: rb.Body(np.diag([1, 2, -1])), "inertia is not positive definite"),
        (lambda: rb.Body([np.eye(3), np.ones((3, 3))]), r"inertia\[1\] is not positive definite"),
        (lambda: rb.Body(np.eye(3) + np.eye(3, k=1)), "inertia is not symmetric"),
        (lambda: rb.Body(np.diag([1.0, 2, 0])), "inertia is not positive definite, to rounding: "),
        (lambda: rb.Body(5e307 * np.eye(3)), "inertia: eigenvalues from 1e-150 to 1e150 are wan"),
        (lambda: rb.Body(1e-310 * G), "inertia: eigenvalues from 1e-150 to 1e150 are wanted"),
        (lambda: rb.Body(G, 0), "mass is 0.0"),
        (lambda: rb.Body(G, [1, 2]), r"mass: shape \(\) is wanted"),
        (lambda: rb.Body(G, centre=[0, 1]), r"centre: shape \(3\) is wanted"),
        (lambda: rb.Body(G, centre=[0, np.nan, 0]), r"centre\[1\] is nan"),
        (lambda: rb.Body.box([1, 2]), r"sides: shape \(..., 3\) is wanted"),
        (lambda: rb.Body.box([[1, 2, 3], [1, -2, 3]]), r"sides\[1, 1\] is -2.0, a length from 0"),
        (lambda: rb.Body.box([[1, 2, 3], [0, 2, 0]]), r"sides\[1\]: at most one length of 0 is"),
        (lambda: rb.Body.box([1, 2, 3], -1), "mass is -1.0"),
        (lambda: rb.projected_cubic(A, X, body=G), "body: a Body is wanted, such as Body"),
        (lambda: rb.projected_cubic([A] * 2, X, body=rb.Body([G] * 3)), "batch .* body"),
        (lambda: rb.projected_cubic(A, X, body=rb.Body([G, np.diag([1, 1, 3])])), THIN),
        (lambda: rb.projected_spline([0, 1], [A, X], body=rb.Body([G, G])), "body"),
    ],
)
def test_errors_name_the_part_of_a_body(make, message):
    with pytest.raises(ValueError, match=f"^{message}"):
        make()


def test_a_body_is_described_by_its_numbers():
    assert repr(rb.Body.ball()) == "<Body: inertia diag(2, 2, 2), mass 1, centre (0, 0, 0)>"
    assert "[2, 0.1, 0; 0.1, 2.5, 0.2; 0, 0.2, 3], mass 1.5, centre (0.1, -0.2, 0.3)" in repr(BODY)
    assert "inertia stack of shape (2,)" in repr(rb.Body(np.stack([G, G])))


def resolved(path):
    return reduce(getattr, path.split(".")[1:], rb)


@pytest.mark.parametrize("name", RENAMED)
def test_a_name_of_version_1_leads_to_its_replacement(name):
    assert name not in rb.__all__
    with pytest.raises(
        AttributeError, match=rf"rbcourse.{name} is gone .*{re.escape(RENAMED[name])}"
    ):
        getattr(rb, name)
    for path in re.findall(r"\brb(?:\.\w+)+", RENAMED[name]):
        assert resolved(path) is not None
    for attribute in re.findall(r"\bc\.(\w+)", RENAMED[name]):
        assert hasattr(rb.optimum.Optimum, attribute)


def test_other_names_are_unknown():
    with pytest.raises(AttributeError, match="module 'rbcourse' has no attribute 'geodesics'"):
        _ = rb.geodesics
    assert {"optimum", "closed_forms", "draw"} <= set(dir(rb))
    assert not {*RENAMED} & {*dir(rb)}


def test_a_twist_has_the_velocity_of_the_fixed_frame_in_the_body_frame():
    w, d_dot = np.random.default_rng(8).normal(size=(2, 4, 3))
    twists = rb.twist_from_rates([A, X, A, X], w, d_dot)
    c = rb.projected_cubic(np.eye(4), [A, X, A, X], v1=twists)
    rate = (c(1) - c(1 - 1e-7)) / 1e-7
    assert np.abs(rate[:, :3, 3] - d_dot).max() < 1e-5
    assert np.array_equal(twists[:, :3], w)


BEST = rb.minimum_acceleration(A, X)
SPLINE = rb.projected_spline([0, 1, 3], [A, X, A])
TIMED = rb.fastest(SPLINE, acceleration=1, angular_acceleration=1)
HALF_TURN = np.diag([1.0, -1, -1])
DESCRIBED = {
    "<RigidMotion on SE(3), t in [0, 2]>": rb.geodesic(A, X, duration=2),
    "<ProjectedPolynomial on SO(3), stack of shape (2,), t in [0, 1]>": rb.projected_cubic(
        np.eye(3), [X[:3, :3]] * 2
    ),
    f"<Optimum of acceleration on SE(3), t in [0, 1], cost {BEST.cost:.6g}, a proven local "
    "minimum>": BEST,
    "<Chain of 2 legs, RigidMotion, on SE(3), t in [0, 3]>": SPLINE,
    "<Moved on SE(3), t in [0, 1]>": BEST.moved(X),
    f"<Timed on SE(3), t in [0, {TIMED.domain[1]:g}]>": TIMED,
}


@pytest.mark.parametrize("text", DESCRIBED)
def test_a_curve_is_described_and_drawn(text):
    """A notebook shows the text and, for single curves, a graph of each speed."""
    curve = DESCRIBED[text]
    assert repr(curve) == text
    shown = ElementTree.fromstring(curve._repr_html_().replace("<br>", "<br/>"))
    assert "".join(shown.itertext()).startswith(text[1:-1])
    graphs = shown.findall(".//polyline")
    assert len(graphs) == (0 if curve.batch_shape else curve.size - 2)
    if not curve.batch_shape:
        rates = curve(np.linspace(*curve.domain, 121), 1).reshape(121, -1, 3)
        for graph, speed in zip(graphs, np.linalg.norm(rates, axis=2).T, strict=True):
            _, y = np.array([p.split(",") for p in graph.get("points").split()], float).T
            assert np.ptp(y + 56 * speed / speed.max()) < 0.11  # the graph is 56 px high
            assert f"up to {speed.max():.3g} " in "".join(shown.itertext())


def test_a_curve_that_jumps_is_described_without_a_graph():
    with pytest.warns(RuntimeWarning, match="jumps"):
        curve = rb.projected_line(np.eye(3), HALF_TURN)
    assert curve._repr_html_() == "<div>ProjectedLine on SO(3), t in [0, 1]</div>"


def test_drawing_without_matplotlib_names_the_extra(monkeypatch):
    def fail(name):
        raise ModuleNotFoundError("No module named 'matplotlib'", name="matplotlib")

    monkeypatch.setattr(rb, "import_module", fail)
    for name in ("draw", "paper", "report"):
        with pytest.raises(ModuleNotFoundError) as caught:
            rb.__getattr__(name)
        assert caught.value.__notes__ == [f"rbcourse.{name} needs the extra draw, see README.md"]
