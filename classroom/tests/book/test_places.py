"""Addresses in the book."""

from rbclassroom.book.places import anchor, file_of, full_name, relinked, source_of, with_keys
from rbclassroom.course.ledger import MISPRINTS, WHAT


def test_each_key_has_its_own_anchor():
    keys = [*WHAT, *MISPRINTS]
    assert len({anchor(key) for key in keys}) == len(keys)
    assert anchor("BK 1") != anchor("BK (1)")


def test_only_keys_in_running_text_become_links():
    assert with_keys("<small>BK 6.1, BK (16)</small>", "lessons/06_geodesics.ipynb") == (
        '<small><a href="../ledger.html#bk-6-1">BK 6.1</a>, '
        '<a href="../ledger.html#bk-eq-16">BK (16)</a></small>'
    )
    assert with_keys("BK 2002, BK 6.1.2, BK Fig. 5a", "x.md") == "BK 2002, BK 6.1.2, BK Fig. 5a"


def test_links_between_files_become_links_between_pages():
    lesson = "notebooks/01_plane.ipynb", "lessons/01_plane.ipynb"
    install = "README.md", "install.md"
    kept = "`f[i](x)` [m](mailto:a@b.org) [c](https://x.org) [d](#here)"
    for place, text, wanted in [
        (lesson, "[a](../docs/ledger.md)", "[a](../ledger.md)"),
        (lesson, "[e](../LICENSE)", "[e](../files/LICENSE)"),
        (lesson, "[b](06_geodesics.ipynb#x)", "[b](06_geodesics.ipynb#x)"),
        (install, "[b](notebooks/06_geodesics.ipynb)", "[b](lessons/06_geodesics.ipynb)"),
        (install, "[a](notebooks/assignments)", "[a](teach/problem_sets.md)"),
        (install, kept, kept),
    ]:
        assert relinked(text, *place) == wanted


def test_each_module_is_mapped_to_its_page():
    for module in ("draw.save", "atlas", "optimum"):
        assert source_of(file_of(module)) == f"package/{module}.rst"
    assert full_name("draw.save") == "rbcourse.draw.save"
    assert full_name("atlas") == "rbclassroom.atlas"
    problem_set = "notebooks/assignments/source/ps1/ps1.ipynb"
    for path in ("rbcourse/_foam.py", "course.py", "LICENSE", problem_set):
        assert source_of(path) is None
