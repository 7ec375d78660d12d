import re

import pytest

KEY = re.compile(
    r"(BK|RR) (\(\d+\)|\d+(\.\d+)?|(Prop\.|Cor\.|Remark|Fig\.) \d+)|errata \d+", re.ASCII
)


def pytest_collection_modifyitems(items):
    """A mistyped key would be lost in silence: ``source("BK (16)")``, ``source("errata 9")``."""
    for item in items:
        for mark in item.iter_markers("source"):
            for key in mark.args:
                if not KEY.fullmatch(key):
                    raise pytest.UsageError(f"{item.nodeid}: {key!r} is no key of a text")
