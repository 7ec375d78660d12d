"""Replace the keys of works in a text by links that show names and years."""

import re
import unicodedata
from collections.abc import Mapping

_ACCENTS = {
    "'": "\N{COMBINING ACUTE ACCENT}",
    '"': "\N{COMBINING DIAERESIS}",
    "v": "\N{COMBINING CARON}",
}
_KEY = r"[A-Za-z]+\d{4}"
_CITED = re.compile(rf"\[({_KEY}(?:[,;] {_KEY})*)\]")
_WORK = re.compile(rf"^- \[({_KEY})\] ", re.MULTILINE)


def names(bibliography: str) -> dict[str, str]:
    r"""Return a dict that maps the keys of works in a BibTeX file to names for citations.

    Examples
    --------
    >>> names("@article{Noakes2011,\n author = {Noakes, Lyle},\n year = {2011}\n}\n")
    {'Noakes2011': 'Noakes (2011)'}
    """
    plain = re.sub(
        r"\\(['\"v])\{(\w)\}|\{\\(['\"v])(\w)\}",
        lambda x: unicodedata.normalize("NFC", (x[2] or x[4]) + _ACCENTS[x[1] or x[3]]),
        bibliography,
    )
    found = {}
    for entry in re.finditer(r"@\w+\{(\w+),(.*?)\n\}", plain, re.DOTALL):
        authors, year = (
            re.search(rf"\b{name} = \{{(.*)\}}", entry[2]) for name in ("author", "year")
        )
        if not authors or not year:
            raise ValueError(f"{entry[1]} has no author or no year")
        last = [author.partition(",")[0] for author in authors[1].split(" and ")]
        who = f"{last[0]} et al." if len(last) > 2 else " and ".join(last)
        found[entry[1]] = f"{who} ({year[1]})"
    return found


def with_citations(text: str, known: Mapping[str, str], here: set[str], elsewhere: str) -> str:
    """Return a text with citations as links, and with link targets in its list of works.

    Citations of the keys `here` link to the list on this page; all others link to the page
    `elsewhere`.
    """

    def put(match: re.Match[str]) -> str:
        keys = re.split("[,;] ", match[1])
        links = [
            f'<a href="{"" if key in here else elsewhere}#{key}">{known[key]}</a>' for key in keys
        ]
        return f"[{', '.join(links)}]"

    return _CITED.sub(put, _WORK.sub(r'- <a id="\1"></a>', text))


def listed(text: str) -> set[str]:
    """Return the keys of the works that a page lists."""
    return set(_WORK.findall(text))
