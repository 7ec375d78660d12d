"""The atlas of real bodies: its curves, its domains, and what is known of a quantile."""

import numpy as np
import pytest

import rbcourse as rb
from rbclassroom.surveys import atlas, body_atlas, survey

DRAWS = 3
PROBLEMS = body_atlas.body_problems(DRAWS, 1)


def norms(x):
    return np.linalg.norm(x, axis=-1)


@pytest.mark.parametrize(("name", "sides"), [("brick", [28, 24, 20]), ("book", [30, 20, 3])])
def test_the_bodies_are_boxes(name, sides):
    """The inertia of points on a grid in the box, by ∫ (p·p I − p pᵀ) dm."""
    n = 20
    p = np.moveaxis((np.indices((n, n, n)) + 0.5) / n - 0.5, 0, -1).reshape(-1, 3)
    p = p * np.array(sides) / 100
    squares = np.sum(p**2, axis=-1)[:, None, None] * np.eye(3)
    G = np.mean(squares - p[:, :, None] * p[:, None], axis=0)
    assert np.abs(body_atlas.BODIES[name] / G - 1)[np.eye(3) > 0] == pytest.approx(0, abs=0.003)


def test_the_ball_has_the_metric_of_the_paper():
    few = PROBLEMS.take(slice(0, None, 60))
    costs = survey.costs(rb.exponential_cubic_so3, few, body_atlas.BODIES["ball"])
    assert costs == pytest.approx(survey.costs(rb.exponential_cubic_so3, few), rel=1e-12)


def test_end_velocities_point_in_any_direction():
    many = body_atlas.body_problems(100, 2)
    sigma = rb.log_so3(many.R0.mT @ many.R1)
    for x in (many.w0, many.w1):
        cosine = np.sum(x * sigma, axis=-1) / norms(x) / norms(sigma)
        assert np.quantile(cosine, [0.25, 0.5, 0.75]) == pytest.approx([-0.5, 0, 0.5], abs=0.03)
        direction = x / norms(x)[:, None]  # in the body: uniform, too
        assert np.abs(direction.mean(axis=0)).max() < 0.03
        assert direction.T @ direction / 10000 == pytest.approx(np.eye(3) / 3, abs=0.02)
    apart = np.sum(many.w0 * many.w1, axis=-1) / norms(many.w0) / norms(many.w1)
    assert np.quantile(apart, [0.25, 0.5, 0.75]) == pytest.approx([-0.5, 0, 0.5], abs=0.03)


@pytest.mark.parametrize(
    ("name", "turn", "speed", "count"), [("small", 36, 1.8, 4), ("medium", 90, 4.5, 25)]
)
def test_a_domain_is_what_its_words_say(name, turn, speed, count):
    inside = body_atlas.domain(name, DRAWS)
    sigma = np.degrees(norms(rb.log_so3(PROBLEMS.R0.mT @ PROBLEMS.R1)))
    v = np.hypot(norms(PROBLEMS.w0), norms(PROBLEMS.w1))
    assert np.array_equal(inside, (sigma < turn) & (v < speed))
    assert inside.sum() == count * DRAWS
    assert body_atlas.domain_in_words(name) == f"up to {turn}° and {speed} rad"


@pytest.fixture(scope="module")
def excess():
    few = body_atlas.body_problems(1, 3)
    found = {}
    for body, inertia in body_atlas.BODIES.items():
        costs = survey.survey(few, inertia=inertia, ways=body_atlas.curves_for(body))
        found[body] = body_atlas.with_choices(atlas.excesses(few, costs, inertia)), costs
    return found


def test_the_cheapest_of_three_is_a_curve_that_costs_so(excess):
    chosen, costs = excess["book"]
    assert list(chosen) == list(body_atlas.CURVES)
    both = np.minimum(costs["Bézier"], costs["other way"])
    assert chosen["two Béziers"] == pytest.approx(both / costs["optimum"] - 1)
    three = np.minimum(both, costs["normal"])
    assert chosen["three"] == pytest.approx(three / costs["optimum"] - 1)
    ball = rb.minimum_acceleration_so3(*body_atlas.body_problems(1, 3))
    cost = rb.acceleration_cost(ball, body_atlas.BODIES["book"])
    assert chosen["ball's optimum"] == pytest.approx(cost / costs["optimum"] - 1, abs=1e-5)


def test_for_a_ball_the_inertia_says_nothing(excess):
    chosen, _ = excess["ball"]
    assert chosen["weighted"] == pytest.approx(chosen["projection"], rel=1e-5)
    assert chosen["normal"] == pytest.approx(chosen["exponential"], rel=1e-5, abs=1e-9)
    assert np.abs(chosen["ball's optimum"]).max() < 1e-6


def test_the_maps_have_a_row_for_each_cell_of_each_body(excess):
    table = body_atlas.maps({body: chosen for body, (chosen, _) in excess.items()}, 1)
    assert table["body"].tolist() == [body for body in body_atlas.BODIES for _ in range(100)]
    for name in ("median", "90 %"):
        got = table[f"three {name} [1]"][200:]
        assert got == pytest.approx(excess["book"][0]["three"], rel=5e-4, abs=1e-8)


def made_up(rng, draws=50):
    """Excesses with the median 0.1 and the 90 % quantile 0.18, of all curves but one."""
    x = {curve: 0.2 * rng.random(100 * draws) for curve in body_atlas.CURVES}
    return {**x, "Cayley": 2 + x["Cayley"]}


def test_the_intervals_hold_for_19_of_20_samples():
    rng, held, samples = np.random.default_rng(1), np.zeros(3), 60
    for _ in range(samples):
        table = body_atlas.intervals(made_up(rng), 50)
        row = (table["domain"] == "medium") & (table["curve"] == "normal")
        truths = {"median": 0.1, "90 %": 0.18, "cheapest": 1 / 7}
        for k, (name, truth) in enumerate(truths.items()):
            low, high = (table[f"{name} {end} [1]"][row].item() for end in ("low", "high"))
            assert low < table[f"{name} [1]"][row].item() < high
            held[k] += low <= truth <= high
    assert held.min() > 0.85 * samples


def test_the_intervals_are_of_what_they_say():
    rng = np.random.default_rng(2)
    excess, draws = made_up(rng), 50
    excess["projection"][:7] = np.nan  # near zero
    table = body_atlas.intervals(excess, draws)
    inside = body_atlas.domain("small", draws) & ~np.isnan(excess["projection"])
    assert table["curve"].tolist() == 3 * list(body_atlas.CURVES)
    for k, curve in enumerate(body_atlas.CURVES):
        x = excess[curve][inside]
        assert table["problems [1]"][k] == 200 - 7
        assert table["median [1]"][k] == pytest.approx(np.median(x), rel=5e-4)
        assert table["within a tenth [1]"][k] == pytest.approx(np.mean(x < 0.1), rel=5e-4)
    others = np.min([excess[curve] for curve in body_atlas.CLOSED_FORMS], axis=0)
    share = np.mean(excess["Bézier"][inside] == others[inside])
    assert table["cheapest [1]"][3] == pytest.approx(share, rel=5e-4)
    assert np.isnan(table["cheapest [1]"][-3:]).all()


def test_a_family_that_is_none_is_named():
    with pytest.raises(ValueError, match=r"^families: along, across and any .*\['around'\]"):
        atlas.atlas_problems(1, ["along", "around"])
