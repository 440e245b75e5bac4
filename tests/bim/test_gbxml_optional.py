"""gbXML: an optional value never refuses a file; each is removed and spoilt alone."""

from __future__ import annotations

import xml.etree.ElementTree as ElementTree
from collections.abc import Iterator

import pytest
from test_read_gbxml import written
from test_stated_use import used_gbxml

from bim.gbxml.building import read_gbxml
from mitsuba_cfs.errors import DataError

# Without these there is no geometry: the polygons of surfaces, the unit of their lengths, and
# the rooms that they name.
GEOMETRY = {
    "Coordinate",
    "CartesianPoint",
    "PolyLoop",
    "PlanarGeometry",
    "AdjacentSpaceId",
    "Surface",
    "Space",
    "Building",
    "Campus",
    "gbXML",
}
ROOT_ATTRIBUTES = {"areaUnit", "volumeUnit", "temperatureUnit", "version"}
SPOILT = ("", "x", "-1e30", "NaN", "1e400")


def changes() -> Iterator[tuple[str, str]]:
    """What was changed, and the text of the file."""
    root = ElementTree.fromstring(used_gbxml())
    owners = {child: owner for owner in root.iter() for child in owner}
    for element in root.iter():
        tag = element.tag.rpartition("}")[2]
        name = f"{tag} {element.get('id', '')}".strip()
        for key, value in list(element.attrib.items()):
            if tag in GEOMETRY and key not in ROOT_ATTRIBUTES:
                continue
            del element.attrib[key]
            yield f"{name}: no {key}", ElementTree.tostring(root, "unicode")
            element.set(key, "x")
            yield f"{name}: {key}='x'", ElementTree.tostring(root, "unicode")
            element.set(key, value)
        if tag in GEOMETRY:
            continue
        owner = owners[element]
        at = list(owner).index(element)
        owner.remove(element)
        yield f"no {name}", ElementTree.tostring(root, "unicode")
        owner.insert(at, element)
        if not len(element) and element.text:
            text = element.text
            for spoilt in SPOILT:
                element.text = spoilt
                yield f"{name}: {spoilt!r}", ElementTree.tostring(root, "unicode")
            element.text = text


def test_a_missing_or_spoilt_optional_value_refuses_nothing(tmp_path):
    refused, count = [], 0
    for what, text in changes():
        count += 1
        try:
            building = read_gbxml(written(tmp_path, text))
        except DataError as error:
            refused.append(f"{what}: {error}")
            continue
        if len(building.spaces) != 2:
            refused.append(f"{what}: {len(building.spaces)} rooms")
    assert not refused, "\n".join(refused)
    assert count > 200


@pytest.mark.parametrize(
    ("tag", "text"),
    [
        ("Latitude", "north"),
        ("CADModelAzimuth", "east"),
        ("Area", "big"),
        ("U-value", "low"),
        ("SolarHeatGainCoeff", "7"),
        ("Thickness", "thin"),
        ("PeopleNumber", "few"),
        ("ScheduleValue", "often"),
        ("R-value", "-3"),
        ("Transmittance", "9"),
        ("Reflectance", "9"),
    ],
)
def test_a_value_that_cannot_be_read_is_an_issue(tmp_path, tag, text):
    root = ElementTree.fromstring(used_gbxml())
    element = next(e for e in root.iter() if e.tag.endswith("}" + tag))
    usual = {issue.code for issue in read_gbxml(written(tmp_path, used_gbxml())).issues}
    assert "value-not-read" not in usual
    element.text = text
    building = read_gbxml(written(tmp_path, ElementTree.tostring(root, "unicode")))
    assert "value-not-read" in {issue.code for issue in building.issues}


@pytest.mark.parametrize(
    "words",
    [
        'openingType="FixedWindow"',
        'windowTypeIdRef="unit"',
        'constructionIdRef="wall"',
        'zoneIdRef="z"',
        'areaUnit="SquareMeters"',
        'layerIdRef="l1"',
        'peopleScheduleIdRef="s"',
    ],
)
def test_an_attribute_that_cannot_be_read_is_an_issue(tmp_path, words):
    text = used_gbxml()
    assert words in text
    building = read_gbxml(written(tmp_path, text.replace(words, words.partition("=")[0] + '="x"')))
    assert "value-not-read" in {issue.code for issue in building.issues}
    assert len(building.spaces) == 2 and len(building.windows) == 1
