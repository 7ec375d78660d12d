"""Find or install the system programs that tests need."""

import os
import shutil
import subprocess

import pytest


def find_program(package, *names):
    """Return the path of a program; install its package if Debian's packages are available."""
    if found := next(filter(None, map(shutil.which, names)), None):
        return found
    if not shutil.which("apt-get"):
        raise pytest.UsageError(f"{names[0]} is not found: install {package}")
    print(f"Installing {package} ...", flush=True)
    apt_get = [*([] if os.geteuid() == 0 else ["sudo"]), "apt-get", "--yes", "-qq"]
    environment = {**os.environ, "DEBIAN_FRONTEND": "noninteractive"}
    for words in (["update"], ["install", "--no-install-recommends", package]):
        subprocess.run([*apt_get, *words], env=environment, stdout=subprocess.DEVNULL, check=True)
    return shutil.which(names[0])
