"""Test the atlas of real bodies: its curves, its domains, and the intervals of quantiles."""

import numpy as np
import pytest
from scipy.stats import binom

import rbcourse as rb
from rbclassroom.surveys import atlas, body_atlas, survey

CURVES, CLOSED_FORMS = body_atlas.CURVES, body_atlas.CLOSED_FORMS


def norms(x):
    return np.linalg.norm(x, axis=-1)


def test_end_velocities_are_uniform_in_direction():
    many = body_atlas.body_problems(100, 2)
    sigma, quartiles = rb.log_so3(many.R0.mT @ many.R1), [-0.5, 0, 0.5]
    for x, y in ((many.w0, sigma), (many.w1, sigma), (many.w0, many.w1)):
        cosine = np.sum(x * y, axis=-1) / norms(x) / norms(y)
        assert np.quantile(cosine, [0.25, 0.5, 0.75]) == pytest.approx(quartiles, abs=0.03)
    for x in (many.w0, many.w1):  # the directions are uniform in the body frame, too
        direction = x / norms(x)[:, None]
        assert np.abs(direction.mean(axis=0)).max() < 0.03
        assert direction.T @ direction / 10000 == pytest.approx(np.eye(3) / 3, abs=0.02)


@pytest.mark.parametrize(
    ("name", "turn", "speed", "count"), [("small", 36, 1.8, 4), ("medium", 90, 4.5, 25)]
)
def test_a_domain_has_the_limits_that_its_description_states(name, turn, speed, count):
    ends, inside = body_atlas.body_problems(3, 1), body_atlas.domain(name, 3)
    sigma = np.degrees(norms(rb.log_so3(ends.R0.mT @ ends.R1)))
    v = np.hypot(norms(ends.w0), norms(ends.w1))
    assert np.array_equal(inside, (sigma < turn) & (v < speed))
    assert inside.sum() == 3 * count
    assert body_atlas.domain_in_words(name) == f"up to {turn}° and {speed} rad"


@pytest.mark.parametrize("body", ["ball", "book"])
def test_the_chosen_curves_are_the_cheapest(body):
    ends, inertia = body_atlas.body_problems(1, 3).take(slice(0, None, 5)), body_atlas.BODIES[body]
    costs = survey.survey(ends, inertia=inertia, ways=body_atlas.curves_for(body))
    excess = body_atlas.with_choices(atlas.excesses(ends, costs, inertia))
    assert list(excess) == list(CURVES)
    both = np.minimum(costs["Bézier"], costs["other way"])
    assert excess["two Béziers"] == pytest.approx(both / costs["optimum"] - 1)
    three = np.minimum(both, costs["normal"])
    assert excess["three"] == pytest.approx(three / costs["optimum"] - 1)
    ball = rb.acceleration_cost(rb.minimum_acceleration_so3(*ends), inertia)
    assert excess["ball's optimum"] == pytest.approx(ball / costs["optimum"] - 1, abs=1e-5)
    if body == "ball":  # the inertia of a ball makes no difference
        assert excess["weighted"] == pytest.approx(excess["projection"], rel=1e-5)
        assert excess["normal"] == pytest.approx(excess["exponential"], rel=1e-5, abs=1e-9)
        assert np.abs(excess["ball's optimum"]).max() < 1e-6


@pytest.fixture
def excess():
    """Return invented excesses of 50 problems in each cell; in the small domain, seven are near
    zero."""
    rng = np.random.default_rng(2)
    x = {curve: 0.2 * rng.random(5000) for curve in CURVES}
    x["projection"][:7] = np.nan
    return {**x, "Cayley": 2 + x["Cayley"]}


def test_the_maps_have_a_row_for_each_cell_of_each_body(excess):
    table = body_atlas.maps({"one": excess, "two": {k: 2 * x for k, x in excess.items()}}, 50)
    assert table["body"].tolist() == ["one"] * 100 + ["two"] * 100
    assert table["problems [1]"][[0, 1, 100]].tolist() == [43, 50, 43]
    for name, place in (("median", 24), ("90 %", 44)):
        sought = np.sort(excess["three"].reshape(100, 50))[:, place]
        both = np.concatenate([sought, 2 * sought])
        assert table[f"three {name} [1]"] == pytest.approx(both, rel=5e-4)


def test_intervals_of_quantiles_are_binomial(excess):
    table = body_atlas.intervals(excess, 50)
    assert table["curve"].tolist() == 3 * list(CURVES)
    cheapest = np.min([excess[curve] for curve in CLOSED_FORMS], axis=0)
    for k, (domain, curve) in enumerate(zip(table["domain"], table["curve"], strict=True)):
        inside = body_atlas.domain(domain, 50) & ~np.isnan(excess["projection"])
        x, n = np.sort(excess[curve][inside]), inside.sum()
        assert table["problems [1]"][k] == n
        for name, share in (("median", 0.5), ("90 %", 0.9)):
            # entry k is the probability that at most k of the n values are below the quantile
            fewer = binom.cdf(np.arange(n), n, share)
            ends = x[np.sum(fewer <= 0.025) - 1], np.quantile(x, share), x[np.sum(fewer < 0.975)]
            found = [table[f"{name}{end} [1]"][k] for end in (" low", "", " high")]
            assert found == pytest.approx(ends, rel=5e-4)
        cheap = excess[curve][inside] == cheapest[inside]
        for name, chosen in (("within a tenth", x < 0.1), ("cheapest", cheap)):
            low, value, high = (table[f"{name}{end} [1]"][k] for end in (" low", "", " high"))
            if name == "cheapest" and curve not in CLOSED_FORMS:
                assert np.isnan([low, value, high]).all()
                continue
            count = chosen.sum()
            assert value == pytest.approx(count / n, rel=5e-4)
            assert binom.cdf(count, n, high) == pytest.approx(0.025, rel=0.05)
            if count:
                assert binom.sf(count - 1, n, low) == pytest.approx(0.025, rel=0.05)
            else:
                assert low == 0
