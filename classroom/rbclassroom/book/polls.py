"""Show the options of polls; each option unfolds its own explanation, and closes the others."""

import re

from nbformat import NotebookNode

VOTE = re.compile(r"^polls\.buttons\(", re.MULTILINE)  # in a cell with buttons for JupyterLab
_OPTION = re.compile(r"^- \*\*([A-Z])\*\* · (.*)$", re.MULTILINE)
_ITEM = re.compile(r"^- (?=\*\*[A-Z]\*\*)(.*(?:\n .*)*)", re.MULTILINE)
_IDEA = re.compile(r"(?:(?<=[.?!)] )|^)(?=\*\*[A-Z]\*\*)", re.MULTILINE)


def ideas(texts: list[str]) -> tuple[str, dict[str, str]]:
    r"""Find the right letter, and the explanation of each letter, in the answer to a poll.

    The answer is given as the texts of its cells. A paragraph with the right letter in bold
    explains this letter; the items of a list explain the other letters.

    Examples
    --------
    >>> ideas(["It turns: **B**.\n\n- **A** slides. **C** stops."])
    ('B', {'B': 'It turns: **B**.', 'A': '**A** slides.', 'C': '**C** stops.'})
    """
    outside = "\n\n".join(_ITEM.sub("", text) for text in texts)
    right = re.search(r"^(?:.* )?\*\*([A-Z])\*\*.*$", outside, re.MULTILINE)
    if not right:
        raise ValueError("no paragraph of the answer contains the right letter in bold")
    found = {right[1]: re.sub(r":$", ".", right[0].partition("*Look for")[0].strip())}
    for item in (match[1] for text in texts for match in _ITEM.finditer(text)):
        for idea in (part.strip() for part in _IDEA.split(item) if part):
            found.setdefault(idea[2], idea)
    return right[1], found


def voted(cells: list[NotebookNode]) -> None:
    """Let the options of all polls in the cells of a lesson unfold their explanations.

    The cells with the buttons for JupyterLab are removed.
    """
    cells[:] = [cell for cell in cells if not VOTE.search(cell.source)]
    texts = [cell.source if cell.cell_type == "markdown" else "" for cell in cells]
    headings = [i for i, text in enumerate(texts) if text.startswith("#")] + [len(cells)]
    for k in headings[:-1]:
        poll = re.match(r"### (Poll \d+)\b", texts[k])
        if not poll:
            continue
        answer = f"### Answer to {poll[1].lower()}"
        start = next((i for i in headings[:-1] if i > k and texts[i].startswith(answer)), k)
        right, lines = ideas(texts[start : headings[headings.index(start) + 1]])
        letters = {option[1] for option in _OPTION.finditer(texts[k])}
        if missing := letters - set(lines):
            raise ValueError(f"{poll[1]}: the answer does not explain {', '.join(sorted(missing))}")
        cells[k].source = _with_ideas(texts[k], poll[1], right, lines)


def _with_ideas(text: str, name: str, right: str, lines: dict[str, str]) -> str:
    def put(option: re.Match[str]) -> str:
        letter, words = option[1], re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", option[2])
        is_right = letter == right
        line = lines[letter].replace("\n", "\n  ")
        return (
            f'- <details name="{name}"><summary>\n\n'
            f"  **{letter}** <span>{words}</span>\n\n"
            f'  </summary><div role="status" class="idea{" right" * is_right}">\n\n'
            f"  *{'Right.' if is_right else 'Not quite.'}* {line}\n\n  </div></details>\n"
        )

    options = _OPTION.sub(put, text)
    first = options.index("- <details")
    group = f'<div class="poll" role="group" aria-label="{name}">'
    return f"{options[:first]}{group}\n\n{options[first:]}\n</div>"
