import matplotlib.pyplot as plt
import pytest

from rbclassroom.course.ledger import MISPRINTS, WHAT


def pytest_collection_modifyitems(items):
    """Refuse unknown keys in marks such as ``source("BK (16)")`` and ``source("errata 9")``."""
    for item in items:
        for mark in item.iter_markers("source"):
            for key in mark.args:
                if key not in WHAT and key not in MISPRINTS:
                    raise pytest.UsageError(f"{item.nodeid}: {key!r} is not a key of a text")


@pytest.fixture(autouse=True)
def figures_are_closed():
    yield
    plt.close("all")
