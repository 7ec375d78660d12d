"""Test the files of sketches, and that their computed paths are those of the program."""

import re
import xml.etree.ElementTree as ET
from pathlib import Path

import pytest

from rbclassroom.lecture import sketches

FOLDER = Path(__file__).parents[3] / "notebooks" / "slides"
FILES = sorted(FOLDER.glob("*.svg"))
SVG = "{http://www.w3.org/2000/svg}"


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.stem)
def test_each_sketch_has_a_name_a_description_and_a_slide(path):
    page, texts = ET.parse(path).getroot(), path.with_suffix(".md").read_text(encoding="utf-8")
    labels, drawings = page[::2], page[1::2]
    assert [label.text for label in labels] == [each.get("id") for each in drawings]
    for each in drawings:
        assert each.tag == f"{SVG}svg"
        assert each.get("class") == "sketch"
        assert re.fullmatch(r"0 -?\d+ (640|1030|1550) [1-8]\d\d", each.get("viewBox"))
        assert each.get("aria-label")
        assert f"![]({each.get('id')})" in texts


def computed(number):
    """Return the computed paths of a file by their ids."""
    return {
        name: path
        for sketch in sketches.SKETCHES.get(number, ())
        for name, path in sketch().items()
    }


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.stem)
def test_exactly_the_elements_with_an_id_are_computed(path):
    text, paths = path.read_text(encoding="utf-8"), computed(path.stem)
    inner = ET.parse(path).getroot().findall(f"{SVG}svg//*[@id]")
    assert {each.get("id") for each in inner} == set(paths)
    assert sketches.updated(text, paths) == text
    for name, right in paths.items():  # one number was changed by hand
        changed = re.sub(rf'(<path id="{name}" d="M)([\d.]+)', r"\g<1>1\2", text)
        assert f'id="{name}" d="{right}"' in sketches.updated(changed, paths)


def test_a_path_is_written_if_it_differs_by_more_than_the_last_digit():
    text = '<path id="a" d="M1 2 L3 4.1" class="thin"/>'
    assert sketches.updated(text, {"a": "M1 2 L3 4"}) == text
    for other in ("M1 2 L3 4.3", "M1 2 C3 4.1", "M1 2 L3 4.1 5 6"):
        assert sketches.updated(text, {"a": other}) == f'<path id="a" d="{other}" class="thin"/>'
    with pytest.raises(ValueError, match='there is no <path id="b"'):
        sketches.updated(text, {"b": "M1 2"})
