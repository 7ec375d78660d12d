"""Prove Proposition 7 of near_optimal.md in rational arithmetic.

The leading excess E of a closed form is a polynomial in the inner products of sigma, e and d; see
near_optimal.py. For each pair of a worse and a better closed form, ordering.csv has a number c with

    E_worse - c E_better = sum_kl M_kl V_k . V_l + share volume^2,

where volume is sigma . (e x d), share >= 0 and M is positive definite. Each V_k is an inner product
times sigma, e or d; all such products occur except (sigma . sigma) sigma. So the left side is
positive unless e = d = 0. Each product V_k . V_l is a monomial. Of the entries M_kl with the same
monomial, all except one are free. ordering.csv contains the free entries.
"""

import csv
from fractions import Fraction
from pathlib import Path

import near_optimal as near

TABLE = Path(__file__).with_name("ordering.csv")
(ss, se, sd), (_, ee, ed), (_, _, dd) = near.INNER
VOLUME = ss * ee * dd + 2 * se * sd * ed - ss * ed**2 - ee * sd**2 - dd * se**2


# "se d" means (sigma . e) d; names with an even number of letters d come first
VECTORS = [f"{inner} {vector}" for inner in near.NAMES for vector in "sed"]
VECTORS = sorted((name for name in VECTORS if name != "ss s"), key=lambda x: x.count("d") % 2)


def product(a, b):
    """Return the monomial V_a . V_b."""
    inner = dict(zip(near.NAMES, near.RING.gens[1:], strict=True))
    (p, i), (q, j) = a.split(), b.split()
    return inner[p] * inner[q] * near.INNER["sed".index(i)]["sed".index(j)]


def entries():
    """Return the index pairs of the upper triangle of M, grouped by the product V_k . V_l."""
    found = {}
    for i, a in enumerate(VECTORS):
        for b in VECTORS[i:]:
            found.setdefault(product(a, b), []).append((a, b))
    return found


def matrix(form, free):
    """Return M for a polynomial. The free entries determine the first entry of each monomial."""
    upper = {}
    for monomial, pairs in entries().items():
        rest = form.coeff(monomial)
        for pair in pairs[:0:-1]:
            upper[pair] = near.QQ(free.get(pair, 0))
            rest -= upper[pair] * (1 + (pair[0] != pair[1]))
        upper[pairs[0]] = rest / (1 + (pairs[0][0] != pairs[0][1]))
    return upper


def total(upper):
    """Return the sum of M_kl V_k . V_l."""
    return sum(x * (1 + (a != b)) * product(a, b) for (a, b), x in upper.items())


def is_positive(upper):
    """Return whether M is positive definite, which means that D > 0 in M = L D L^T."""
    rows = [[upper.get((a, b)) or upper.get((b, a), 0) for b in VECTORS] for a in VECTORS]
    while rows:
        (pivot, *head), *rows = rows
        if pivot <= 0:
            return False
        rows = [[x - r * y / pivot for x, y in zip(row, head, strict=True)] for r, *row in rows]
    return True


def read(table=TABLE):
    """Return (c, share, free entries of M) for each pair of closed forms."""
    with open(table, newline="", encoding="utf-8") as file:
        (_, *worse), (_, *better), (_, *ratio), (_, *share), *rows = csv.reader(file)
    free = [{} for _ in worse]
    for name, *row in rows:
        for column, entry in zip(free, row, strict=True):
            column[tuple(name.split("."))] = Fraction(entry or 0)
    found = zip(map(Fraction, ratio), map(Fraction, share), free, strict=True)
    return dict(zip(zip(worse, better, strict=True), found, strict=True))


def verify(table=TABLE):
    """Check that E_worse >= c E_better for each pair, and return the numbers c."""
    form, proven = near.forms(), {}
    for (worse, better), (ratio, share, free) in read(table).items():
        left = form[worse] - near.QQ(ratio) * form[better]
        upper = matrix(left - near.QQ(share) * VOLUME, free)
        same = total(upper) + near.QQ(share) * VOLUME == left
        if not (same and share >= 0 and is_positive(upper)):
            raise ValueError(f"not proven: {worse} >= {float(ratio)} {better}")
        proven[worse, better] = ratio
    return proven


if __name__ == "__main__":
    for (worse_form, better_form), least in verify().items():
        print(f"{worse_form} >= {float(least)} {better_form}")
