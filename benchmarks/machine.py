"""On what the times were taken: the processor, the versions, and which peers are installed."""

import importlib
import os
import platform
from importlib.metadata import version
from pathlib import Path

import numpy as np

MODULES = {
    "pytransform3d": ("pytransform3d.rotations", "pytransform3d.batch_rotations"),
    "roma": ("torch", "roma"),
}


def find_peers():
    """Return the modules of the peers that are installed, by their own names, and who is missing.

    Returns
    -------
    dict of str to module
    list of str
    """
    there, missing = {}, []
    for peer, names in MODULES.items():
        try:
            there |= {name.split(".")[-1]: importlib.import_module(name) for name in names}
        except ImportError:
            missing.append(peer)
    return there, missing


def describe(peers):
    """Return a line: the processor, the threads, and the versions of what is compared."""
    vectors = np.show_config(mode="dicts")["SIMD Extensions"].get("found", [])
    wide = any(name.startswith(("X86_V4", "AVX512")) for name in vectors)
    names = {"numpy": "NumPy", "scipy": "SciPy"}
    names |= {"pytransform3d": "pytransform3d"} if "rotations" in peers else {}
    names |= {"roma": "RoMa", "torch": "PyTorch"} if "roma" in peers else {}
    parts = [
        f"{processor()}, {'with' if wide else 'without'} AVX-512, {os.cpu_count()} threads",
        f"OPENBLAS_NUM_THREADS {os.environ.get('OPENBLAS_NUM_THREADS', 'not set')}",
        *([f"{peers['torch'].get_num_threads()} threads of PyTorch"] if "roma" in peers else []),
        f"Python {platform.python_version()}",
        *(f"{shown} {version(name)}" for name, shown in names.items()),
    ]
    return "; ".join(parts)


def processor():
    """Return the name of the processor, where the system tells it."""
    try:
        lines = Path("/proc/cpuinfo").read_text().splitlines()
        return next(line.split(":")[1].strip() for line in lines if line.startswith("model name"))
    except (OSError, StopIteration):
        return platform.processor() or platform.machine()
