"""The task ``figures``: run lessons, and store the outputs and figures that have changed."""

import asyncio
import os
import re
import sys
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path

import nbformat
from nbclient import NotebookClient

from rbclassroom.course import options
from rbclassroom.course.agreement import reconciled_notebook, stale_figures
from rbclassroom.course.notebooks import KERNEL, kernel_address, lesson_paths, normalised
from rbcourse.files import replace_file

OURS = re.compile(r"(lesson\d\d|paper|report)_\w+\.(png|csv|pdf|gif)")
"""The names of files that lessons write to the folder of the figures."""


async def execute(path: Path, figures: Path) -> str:
    """Run a lesson from top to bottom in a new kernel, and return the text of the notebook."""
    notebook = nbformat.read(path, as_version=4)
    client = NotebookClient(
        notebook,
        kernel_name=KERNEL["name"],
        record_timing=False,
        coalesce_streams=True,
        store_widget_state=False,
        timeout=600,
        iopub_timeout=600,
        raise_on_iopub_timeout=True,
        extra_arguments=["--log-level=ERROR"],
        resources={"metadata": {"path": str(path.parent)}},
    )
    kernel = client.create_kernel_manager()
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as folder:
        for name, value in kernel_address(folder).items():
            setattr(kernel, name, value)
        own = {"RBCOURSE_FIGURES": str(figures.resolve()), "IPYTHONDIR": folder}
        await client.async_execute(env={**os.environ, **own})
    return normalised(notebook)


def regenerate(lessons: Path, figures: Path, names: Sequence[str] = ()) -> None:
    """Execute lessons, then rewrite the stored outputs and figures that have changed.

    By default all lessons run; `names` limits the run to lessons whose names begin with one of
    these words. Results that agree up to rounding are not rewritten. If a lesson
    fails, no file is rewritten. If all lessons run, figures that none of them draws are removed.
    """
    every = lesson_paths(lessons)
    if not every:
        raise ValueError(f"{lessons} has no lessons; run this in the folder of the course")
    if unknown := [name for name in names if not any(p.stem.startswith(name) for p in every)]:
        known = f"{every[0].stem[:2]} to {every[-1].stem[:2]}"
        raise ValueError(f"names: numbers of lessons, {known}, are wanted, got {unknown[0]!r}")
    chosen = [path for path in every if not names or path.stem.startswith(tuple(names))]
    with tempfile.TemporaryDirectory() as folder:
        texts = asyncio.run(_executed(chosen, Path(folder)))
        drawn = sorted(Path(folder).iterdir())
        stale = {Path(name).stem for name in stale_figures(Path(folder), figures)}
        changed = [path for path, text in texts.items() if path.read_text("utf-8") != text]
        for path in changed:
            replace_file(path, texts[path].encode())
        figures.mkdir(exist_ok=True)
        for file in drawn:
            if file.stem in stale:  # replace all files of a figure together
                replace_file(figures / file.name, file.read_bytes())
        if chosen == every:
            names_drawn = {each.name for each in drawn}
            for file in list(figures.iterdir()):
                if OURS.fullmatch(file.name) and file.name not in names_drawn:
                    file.unlink()
    print(f"lessons run: {len(texts)}, changed: {len(changed)}; figures changed: {len(stale)}")


async def _executed(paths: Sequence[Path], figures: Path) -> dict[Path, str]:
    """Run lessons, as many at once as there are processors; return their new texts.

    If a lesson fails, lessons that run are finished, so that their kernels end, and no other lesson
    is started.
    """
    free, failed = asyncio.Semaphore(os.cpu_count() or 1), list[Exception]()

    async def run(path: Path) -> str:
        async with free:
            if failed:
                return ""
            start = time.perf_counter()
            try:
                text = await execute(path, figures)
            except Exception as error:
                failed.append(error)
                return ""
            print(f"{path.stem}: {time.perf_counter() - start:.1f} s", flush=True)
            return reconciled_notebook(path.read_text("utf-8"), text)

    texts = await asyncio.gather(*map(run, paths))
    if failed:
        raise failed[0]
    return dict(zip(paths, texts, strict=True))


def main() -> None:
    """Run lessons again, in the folder of the course, and store the changes."""
    numbers = [word.zfill(2) for word in options.parse("figures")[0].lessons]  # 9 means 09
    try:
        regenerate(Path("notebooks"), Path("figures"), numbers)
    except (OSError, ValueError) as error:
        sys.exit(str(error))


if __name__ == "__main__":
    main()
