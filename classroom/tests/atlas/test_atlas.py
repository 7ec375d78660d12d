"""Test the atlas: its problems, its surveys on any executor, and its tables."""

from concurrent.futures import ThreadPoolExecutor
from functools import partial
from unittest.mock import Mock

import numpy as np
import pytest
from scipy.stats import binom

import rbcourse as rb
from rbclassroom import atlas
from rbclassroom.atlas import Problems
from rbclassroom.figures import FORMS, quantile, rounded

SOME = atlas.random_problems(60, 3, rng=2)
BOOK = atlas.BODIES["book"]


def norms(x):
    return np.linalg.norm(x, axis=-1)


def test_each_cell_has_problems_of_its_family():
    ends = atlas.atlas_problems(40, ["along", "across", "any"], rng=1)
    family, turn, speed, _ = np.indices((3, 10, 10, 40)).reshape(4, -1)
    sigma, v = rb.log_so3(ends.R0.mT @ ends.R1), np.hypot(norms(ends.w0), norms(ends.w1))
    assert np.array_equal(np.floor(norms(sigma) / (np.pi / 10)), turn)
    assert np.array_equal(np.floor(v / 0.9), speed)
    for x, y in ((ends.w0, sigma), (ends.w1, sigma), (ends.w0, ends.w1)):
        cosine = np.sum(x * y, axis=-1) / norms(x) / norms(y)
        along, across, free = cosine.reshape(3, -1)
        assert np.abs(np.abs(along) - 1).max() < 1e-9
        assert 0.45 < np.mean(along > 0) < 0.55
        assert np.median(np.abs(across)) == pytest.approx(0 if y is sigma else 0.5**0.5, abs=0.03)
        assert np.quantile(free, [0.25, 0.5, 0.75]) == pytest.approx([-0.5, 0, 0.5], abs=0.04)
    inside = atlas.domain("medium", 40)
    assert np.array_equal(inside, (norms(sigma) < np.pi / 2)[family == 2] & (v < 4.5)[family == 2])


def test_random_problems_are_uniform_in_balls():
    ends = atlas.random_problems(4000, 1.5, rng=3)
    for x, radius in ((rb.log_so3(ends.R0.mT @ ends.R1), 1.5), (ends.w0, 3), (ends.w1, 3)):
        share = (norms(x) / radius) ** 3  # the share of the ball closer to the centre than x
        assert share.max() < 1 + 1e-9
        assert np.quantile(share, [0.25, 0.5, 0.75]) == pytest.approx([0.25, 0.5, 0.75], abs=0.05)
        assert np.abs(x.mean(axis=0)).max() < 0.15 * radius


@pytest.mark.source("BK (18)", "beyond BK 1", "beyond BK 2")
@pytest.mark.parametrize("body", [None, BOOK], ids=["ball", "book"])
def test_a_survey_has_the_optimum_and_the_cost_of_every_curve(body):
    sharp = Problems(np.eye(3)[None], rb.exp_so3([[0, 0, np.radians(179.8)]]), *np.zeros((2, 1, 3)))
    assert rb.projected_cubic(*sharp).margin < 0.004
    few = Problems(*map(np.concatenate, zip(sharp, SOME.take(slice(20)), strict=True)))
    found, best = atlas.survey(few, body=body), rb.minimum_acceleration(*few, body=body)
    assert found.pop("optimum") == pytest.approx(best.cost, rel=1e-12)
    of_body = {"weighted": rb.projected_cubic, "normal": rb.closed_forms.normal_cubic}
    makers = FORMS | {way: partial(make, body=body) for way, make in of_body.items()}
    assert set(found) == set(FORMS if body is None else makers)
    for way, cost in found.items():
        exact = rb.acceleration_cost(makers[way](*few), body=body or rb.Body.ball())
        assert cost == pytest.approx(exact, rel=1e-6)
        assert np.all(cost > (1 - 1e-6) * best.cost)


def test_every_executor_gives_the_same_bytes(monkeypatch, capsys):
    monkeypatch.setattr(atlas, "CHUNK", 5)
    few, found = SOME.take(slice(15)), []
    known = {"body": BOOK, "ways": {"z": rb.closed_forms.bezier}}
    with ThreadPoolExecutor(3) as threads:
        threads.submit = Mock(wraps=threads.submit)
        for executor in (None, threads):
            costs = atlas.survey(few, executor, title="A", **known)
            found.append({name: x.tobytes() for name, x in costs.items()})
    assert found[0] == found[1]
    assert threads.submit.call_count == 3
    assert capsys.readouterr().out == 2 * "A: 5 of 15\rA: 10 of 15\rA: 15 of 15\n"
    assert atlas.survey(few.take(slice(0)), **known)["optimum"].shape == (0,)


def test_an_unsolved_problem_costs_nan_and_an_error_names_the_curve():
    fast = SOME.take(slice(3))._replace(w0=1e3 * np.eye(3), w1=1e3 * np.eye(3)[[1, 2, 0]])
    assert np.isnan(atlas.survey(fast, ways={})["optimum"]).all()
    with pytest.raises(ValueError, match="below 3π") as caught:
        atlas.survey(fast)
    assert caught.value.__notes__ == ["This is the curve 'Bézier' of the survey."]


def test_the_excess_is_nan_if_the_optimum_is_near_zero():
    """For a turn by a with w0 = w1 = a + d along its axis, the optimum costs 24 d²."""
    a, d = 1.0, np.array([0.0, 0.005, 0.01, 0.5])
    e, R0 = np.eye(3)[2], np.tile(np.eye(3), (4, 1, 1))
    w = (a + d)[:, None] * e
    ends = Problems(R0, rb.exp_so3(np.tile(a * e, (4, 1))), w, w)
    excess = atlas.excesses(ends, {"optimum": 24 * d**2, "other": 48 * d**2})
    assert list(excess) == ["other"]
    assert excess["other"] == pytest.approx([np.nan, 1, 1, 1], nan_ok=True)


def test_the_table_has_quantiles_of_the_sample_for_each_cell():
    excess = np.arange(2 * 10 * 10 * 5.0)
    excess[:2] = np.nan
    table = atlas.cell_table({"one": excess, "two": 2 * excess}, 5, {"median": 0.5, "most": 0.8})
    assert table["family"].tolist() == ["along"] * 100 + ["across"] * 100
    some = [0, 9, 10, 199]
    assert table["displacement [rad]"][some] == pytest.approx(np.radians([9, 9, 27, 171]))
    assert table["end velocity [rad]"][some] == pytest.approx([0.45, 8.55, 0.45, 8.55])
    assert table["problems [1]"].tolist() == [3] + [5] * 199
    middle = np.array([3, *(np.arange(1, 200) * 5 + 2)])
    assert table["one median [1]"] == pytest.approx(middle, rel=5e-4)
    assert table["two most [1]"][1:] == pytest.approx(2 * (middle[1:] + 1), rel=5e-4)
    few = np.array([123456.0, 0.00123456, 1.26e-8, -1e-12])
    assert rounded(few).tolist() == [123500.0, 0.001235, 1e-8, 0.0]
    assert quantile(few, 0.75) == 0.001235


def test_the_maps_use_only_the_first_seed_and_intervals_are_binomial(tmp_path, monkeypatch):
    made = []

    def invented(problems, body, executor, title):
        x = 0.2 * np.random.default_rng(len(made)).random(5000)
        x[:7] = np.nan
        made.append(x)
        return {"one": x, "two": 2 + x}

    monkeypatch.setattr(atlas, "body_excesses", invented)
    monkeypatch.setattr(atlas, "TABLES", tmp_path)
    atlas.write_tables(50, [5, 6])
    maps, table = atlas.stored("maps"), atlas.stored("intervals")
    assert maps["body"].tolist() == [body for body in atlas.BODIES for _ in range(100)]
    assert maps["problems [1]"].tolist() == 3 * ([43] + 99 * [50])
    cells = np.sort(np.reshape(made[:3], (300, 50)))
    assert maps["two 90 % [1]"][1:100] == pytest.approx(2 + cells[1:100, 44], rel=5e-4)
    assert table["seed [1]"].tolist() == 18 * [5] + 18 * [6]
    for row, domain in zip((0, 2, 4), atlas.DOMAINS, strict=True):
        x = np.sort(made[0][atlas.domain(domain, 50)])
        x = x[~np.isnan(x)]
        for name, share in (("median", 0.5), ("90 %", 0.9)):
            # entry k is the probability that at most k of the n values are below the quantile
            fewer = binom.cdf(np.arange(len(x)), len(x), share)
            ends = x[np.sum(fewer <= 0.025) - 1], x[np.sum(fewer < 0.975)]
            found = [table[f"{name}{end} [1]"][row] for end in ("", " low", " high")]
            assert found == pytest.approx([np.quantile(x, share), *ends], rel=5e-4)
        low, part, high = (table[f"within a tenth{x} [1]"][row] for x in (" low", "", " high"))
        few = np.sum(x < 0.1)
        assert part == pytest.approx(few / len(x), rel=5e-4)
        assert binom.cdf(few, len(x), high) == pytest.approx(0.025, rel=0.05)
        assert binom.sf(few - 1, len(x), low) == pytest.approx(0.025, rel=0.05)


@pytest.mark.slow
@pytest.mark.parametrize("seed", [12, 13])
def test_the_conclusions_of_lesson_12_hold_for_other_samples(seed):
    problems = atlas.atlas_problems(5, rng=seed)
    found = atlas.survey(problems)
    other = atlas.costs(partial(rb.closed_forms.bezier, long=True), problems)
    excess = atlas.excesses(problems, {**found, "other way": other})
    for k in range(2):
        median = {name: quantile(x.reshape(2, -1)[k], 0.5) for name, x in excess.items()}
        del median["other way"]
        assert min(median.values()) in (median["Bézier"], median["corrected"])
        assert median["Bézier"] < 0.002
        assert min(median["projection"], median["Cayley"]) > 5 * median["quaternion"]
    either = np.fmin(excess["Bézier"], excess["other way"])
    assert quantile(either, 0.99) < 0.12
    assert either.max() < 0.3


def test_lesson_13_ranks_curves_whose_intervals_do_not_overlap():
    """The ranks hold in each domain for all seeds, and the medians are those of the lesson."""
    known = atlas.stored("intervals")

    def median(seed, body, domain, curve, end=""):
        words = {"seed [1]": seed, "body": body, "domain": domain, "curve": curve}
        row = np.all([known[name] == word for name, word in words.items()], axis=0)
        return known[f"median{end} [1]"][row].item()

    def is_lower(curve, other, *of):
        return all(
            median(seed, *of, curve, " high") < median(seed, *of, other, " low")
            for seed in (31, 32, 33)
        )

    for domain in atlas.DOMAINS:
        assert is_lower("two Béziers", "normal", "ball", domain)
        assert is_lower("normal", "two Béziers", "book", domain)
        assert all(is_lower("normal", "weighted", body, domain) for body in atlas.BODIES)
        assert is_lower("weighted", "two Béziers", "book", domain) == (domain != "all")
    for body in ("brick", "book"):
        assert all(is_lower("three", each, body, "all") for each in ("normal", "two Béziers"))
    of = {
        ("ball", "all", "two Béziers"): 0.08,
        ("brick", "medium", "normal"): 0.04,
        ("book", "medium", "normal"): 0.35,
        ("brick", "all", "three"): 0.75,
        ("book", "all", "three"): 6,
    }
    for words, percent in of.items():
        assert 100 * median(31, *words) == pytest.approx(percent, rel=0.08), words
    assert all(median(31, body, "small", "weighted") < 7e-4 for body in atlas.BODIES)
