"""Where the kernels of all tests listen."""

import tempfile
from functools import partial

import nbval.kernel

from rbcourse.lessons import kernel_address


def pytest_configure(config):
    """Give the kernels of notebooks that are tests an address that no other program can take."""
    folder = tempfile.TemporaryDirectory(ignore_cleanup_errors=True)
    config.add_cleanup(folder.cleanup)
    address = kernel_address(folder.name)
    nbval.kernel.KernelManager = partial(nbval.kernel.KernelManager, **address)
