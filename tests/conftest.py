import sys

import pytest


@pytest.fixture(autouse=True)
def figures_are_closed():
    yield
    if plt := sys.modules.get("matplotlib.pyplot"):
        plt.close("all")
