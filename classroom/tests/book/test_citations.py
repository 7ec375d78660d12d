"""Test that keys of works become links."""

import re
from pathlib import Path

import pytest

from rbclassroom.book.citations import listed, names, with_citations

BIBLIOGRAPHY = (Path(__file__).parents[3] / "notebooks" / "REFERENCES.bib").read_text("utf-8")


def test_a_work_is_cited_by_its_authors_and_year():
    found = names(BIBLIOGRAPHY)
    assert len(found) == BIBLIOGRAPHY.count("\n@")
    wanted = {
        "Arvo1992": "Arvo (1992)",
        "CrouchSilvaLeite1995": "Crouch and Silva Leite (1995)",
        "Juttler1994": "Jüttler (1994)",
        "NoakesHeinzingerPaden1989": "Noakes et al. (1989)",
        "SeguinKressner2022": "Séguin and Kressner (2022)",
        "ZefranKumarCroke1998": "Žefran et al. (1998)",
    }
    assert {key: found[key] for key in wanted} == wanted
    assert all(re.fullmatch(r"[\w .-]+ \(\d{4}\)", name) for name in found.values())
    with pytest.raises(ValueError, match="Nobody2000 has no author"):
        names("@book{Nobody2000,\n year = {2000}\n}")


def test_a_citation_links_to_the_references_on_its_page():
    known = {"Arvo1992": "Arvo (1992)", "Miles1965": "Miles (1965)"}
    text = "As in [Arvo1992; Miles1965].\n\n- [Arvo1992] James Arvo, *Fast*."
    assert listed(text) == {"Arvo1992"}
    assert with_citations(text, known, listed(text), "../references.html") == (
        'As in [<a href="#Arvo1992">Arvo (1992)</a>, '
        '<a href="../references.html#Miles1965">Miles (1965)</a>].\n\n'
        '- <a id="Arvo1992"></a>James Arvo, *Fast*.'
    )
