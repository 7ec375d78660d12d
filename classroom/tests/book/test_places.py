"""Addresses in the book."""

from rbclassroom.book.places import anchor, relinked, source_of, with_keys
from rbclassroom.course.ledger import MISPRINTS, WHAT


def test_each_key_has_an_anchor_of_its_own():
    keys = [*WHAT, *MISPRINTS]
    assert len({anchor(key) for key in keys}) == len(keys)
    assert anchor("BK 1") != anchor("BK (1)")


def test_keys_in_a_text_lead_to_the_ledger():
    assert with_keys("<small>BK 6.1, BK (16)</small>", "lessons/06_geodesics.ipynb") == (
        '<small><a href="../ledger.html#bk-6-1">BK 6.1</a>, '
        '<a href="../ledger.html#bk-eq-16">BK (16)</a></small>'
    )


def test_links_between_files_become_links_between_pages():
    text = (
        "[a](../docs/ledger.md) [b](06_geodesics.ipynb#x) [c](https://x.org) [d](#here) "
        "[e](../LICENSE)"
    )
    assert relinked(text, "notebooks/01_plane.ipynb", "lessons/01_plane.ipynb") == (
        "[a](../ledger.md) [b](06_geodesics.ipynb#x) [c](https://x.org) [d](#here) "
        "[e](../files/LICENSE)"
    )
    text = "`f[i](x)` [m](mailto:a@b.org)"
    assert relinked(text, "README.md", "install.md") == text
    text = "[a](notebooks/assignments) [b](notebooks/06_geodesics.ipynb)"
    assert relinked(text, "README.md", "install.md") == (
        "[a](teach/problem_sets.md) [b](lessons/06_geodesics.ipynb)"
    )


def test_only_keys_are_linked():
    assert with_keys("BK 2002, BK 6.1.2, BK Fig. 5a", "x.md") == "BK 2002, BK 6.1.2, BK Fig. 5a"


def test_what_has_no_page_has_no_source():
    assert source_of("rbcourse/_foam.py") is None
    assert source_of("course.py") is None
    assert source_of("notebooks/assignments/source/ps1/ps1.ipynb") is None
