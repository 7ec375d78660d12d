import os
import shutil
import tempfile
from functools import partial

import nbval.kernel
import pytest

from rbcourse.ledger import MISPRINTS, SOURCES


def pytest_configure(config):
    """Kernels are reached by files: a port found free may be taken before a kernel takes it."""
    if os.name != "nt":
        folder = tempfile.mkdtemp()
        config.add_cleanup(partial(shutil.rmtree, folder))
        by_file = {"transport": "ipc", "ip": os.path.join(folder, "kernel")}
        nbval.kernel.KernelManager = partial(nbval.kernel.KernelManager, **by_file)


def pytest_collection_modifyitems(items):
    """A mistyped key would be lost in silence: ``source("BK (16)")``, ``source("errata 9")``."""
    for item in items:
        for mark in item.iter_markers("source"):
            for key in mark.args:
                if key not in SOURCES["entries"] and key not in MISPRINTS:
                    raise pytest.UsageError(f"{item.nodeid}: {key!r} is no key of a text")
