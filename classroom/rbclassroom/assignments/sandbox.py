"""The sandbox ("box") of the kernel that runs a submission; it uses bubblewrap on Linux.

On the disk, the kernel sees only its own folder, the system's programs, the package, and this
Python with its libraries. It has no network and few environment variables. When the kernel ends,
its processes end, too. Outside Linux, or if bubblewrap does not work, there is no sandbox, and
submissions run only if the lecturer asks for it (``grade --without-box``).
"""

import functools
import os
import platform
import secrets
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import matplotlib

import rbclassroom
import rbcourse

PROCESSES = 128  # the largest number of processes and threads
FILE_BYTES = 100_000_000
NOBODY = 2**30  # if root grades, each kernel gets an unused user id above this number
# keys of a Linux session outlive its processes, so each command begins a new session
KEYCTL = {"x86_64": 250, "aarch64": 219}.get(platform.machine(), -1)
ALONE = f"import ctypes, os, sys; ctypes.CDLL(None).syscall({KEYCTL}, 1, None); "
ALONE += "os.execvp(sys.argv[1], sys.argv[1:])"
KEPT = ("PATH", "LANG", "LC_ALL", "LC_CTYPE", "TZ", "SYSTEMROOT", "PATHEXT")
SYSTEM = ["/usr", "/bin", "/sbin", "/lib", "/lib32", "/lib64", "/libx32"]
SYSTEM += ["/etc/alternatives", "/etc/fonts", "/etc/ld.so.cache", "/etc/localtime", "/nix/store"]


@functools.cache
def missing() -> str:
    """Return "" if there is a sandbox, otherwise one line with the reason and a remedy."""
    if sys.platform != "linux":
        return "it needs Linux, for example in a virtual machine or in WSL 2"
    if not shutil.which("bwrap"):
        return "bubblewrap is not installed (on Debian and Ubuntu: sudo apt install bubblewrap)"
    if KEYCTL < 0:
        return f"it does not know how to hide session keys on {platform.machine()}"
    with tempfile.TemporaryDirectory() as folder:
        prepare(Path(folder))
        words = [*box(Path(folder), 60), sys.executable, "-c", "import ipykernel, rbclassroom"]
        settings: dict[str, Any] = {"capture_output": True, "text": True, "errors": "replace"}
        try:
            subprocess.run(words, env=environment(Path(folder)), check=True, **settings)
        except subprocess.CalledProcessError as error:
            said = (error.stderr.strip() or f"its exit code is {error.returncode}").splitlines()[-1]
            if said.startswith("bwrap: "):
                return f"bubblewrap does not work here ({said}); user namespaces have to be allowed"
            return f"the sandbox does not work here ({said})"
        except OSError as error:  # setpriv or another program of util-linux is not there
            return f"{error.filename} does not work here ({error.strerror})"
    return ""


def prepare(folder: Path) -> None:
    """Make the folders in which the kernel works and keeps its files."""
    for name in ("work", "tmp", "matplotlib"):
        (folder / name).mkdir(exist_ok=True)
    # without this list, Matplotlib needs seconds to search for fonts
    for fonts in Path(matplotlib.get_cachedir()).glob("fontlist-*.json"):
        shutil.copy(fonts, folder / "matplotlib")


def delete(folder: Path) -> None:
    """Delete a kernel's folder with all its content, including locked files and links."""
    for _ in range(50):  # a kernel may still write while it ends
        if os.name == "nt":
            shutil.rmtree(folder, ignore_errors=True)
        else:
            words = ["sh", "-c", 'chmod -R u+rwX "$0"; rm -rf "$0"', str(folder)]
            subprocess.run(words, capture_output=True)
        if not folder.exists():
            return
        time.sleep(0.1)


def environment(folder: Path) -> dict[str, str]:
    """Return the environment variables of the kernel, none of which is secret."""
    own = dict.fromkeys(("HOME", "USERPROFILE", "IPYTHONDIR"), str(folder))
    own |= dict.fromkeys(("TMPDIR", "TEMP", "TMP"), str(folder / "tmp"))
    own |= dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"), "1")
    kept = {name: os.environ[name] for name in KEPT if name in os.environ}
    return kept | own | {"MPLCONFIGDIR": str(folder / "matplotlib")}


def box(folder: Path, seconds: int) -> list[str]:
    """Return the beginning of a command that runs in the sandbox and can write only to `folder`."""
    packages = (path for package in (rbcourse, rbclassroom) for path in package.__path__)
    python, is_root = [sys.prefix, sys.base_prefix, *packages], os.geteuid() == 0
    seen = {str(parent) for path in (*python, str(folder)) for parent in Path(path).parents}
    kinds = ["ipc", "pid", "net", "uts", "cgroup-try"] + ["user"] * (not is_root)
    # root has these powers until the user changes
    powers = ["SETUID", "SETGID", "DAC_READ_SEARCH"] * is_root
    # the command ends when this process ends, or after `seconds`
    words = ["setpriv", "--pdeathsig=KILL", "timeout", "--signal=KILL", str(seconds)]
    words += [sys.executable, "-ISc", ALONE, "bwrap", "--die-with-parent", "--new-session"]
    words += [*(f"--unshare-{kind}" for kind in kinds), "--cap-drop", "ALL"]
    words += [word for power in powers for word in ("--cap-add", f"CAP_{power}")]
    words += ["--unsetenv", "JPY_PARENT_PID", "--dir", "/etc", "--proc", "/proc", "--dev", "/dev"]
    for path in SYSTEM:
        link = os.path.islink(path)
        words += ["--symlink", os.readlink(path), path] if link else ["--ro-bind-try", path, path]
    for path in ("/tmp", "/dev/shm"):  # by default these folders are in memory, without a limit
        words += ["--bind", str(folder / "tmp"), path]
    for parent in sorted(seen)[1:]:  # without this, parent folders keep their real permissions
        words += ["--dir", parent]
    for path in python:
        words += ["--ro-bind", path, path]
    words += ["--bind", str(folder), str(folder), "--chdir", str(folder / "work")]
    words += ["--remount-ro", "/dev", "--remount-ro", "/", "--"]
    if is_root:
        user = NOBODY + secrets.randbelow(NOBODY)  # the limit on processes is per user
        for inner in (folder, *folder.rglob("*")):
            os.chown(inner, user, user)
        words += ["setpriv", f"--reuid={user}", f"--regid={user}", "--clear-groups"]
        words += ["--no-new-privs", "--"]
    return [*words, "prlimit", f"--nproc={PROCESSES}", f"--fsize={FILE_BYTES}", "--core=0", "--"]


def put_in_box(manager: Any, folder: Path, seconds: int) -> None:
    """Let a manager start its kernel in the sandbox, with a folder and a time limit."""
    spec = manager.kernel_spec
    manager.connection_file = str(folder / "connection.json")
    manager.write_connection_file()
    spec.argv = [*box(folder, seconds), sys.executable, *spec.argv[1:]]
    spec.interrupt_mode = "message"  # an interrupt by a signal would end the sandbox
