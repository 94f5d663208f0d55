"""A footprint as KML and GeoJSON: the ends of the flights and the outlines of their regions, for other programs.

Plain text with the same bytes every time.  KML 2.3 (OGC 12-007r2); GeoJSON of RFC 7946, whose lines are cut at the
date line as its section 3.1.9 asks.  Regions are lines, not areas: an area about a pole has no polygon in degrees.
"""

import json
import re
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any
from xml.etree import ElementTree

import numpy as np

DECIMALS = 7  # of a degree: a centimetre
COLOURS = {"case": "ffb27200", "mark": "ff005ed5", "ellipse": "ff005ed5", "region": "ff739e00"}  # alpha blue green red
Line = list[tuple[float, float]]


@dataclass(frozen=True)
class Mark:
    """A named place, degrees."""

    name: str
    latitude: float
    longitude: float


@dataclass(frozen=True)
class MapOutline:
    """A closed curve, degrees.  kind : "ellipse" or "region"; facts : what is known of it, by name."""

    kind: str
    name: str
    facts: dict[str, float | int]
    latitude: np.ndarray
    longitude: np.ndarray


@dataclass(frozen=True)
class Places:
    """Ends of flights (float64[n] degrees, with case_ids and the cases' status), named places, outlines."""

    title: str
    note: str
    case_ids: np.ndarray
    status: list[str]
    latitude: np.ndarray
    longitude: np.ndarray
    marks: tuple[Mark, ...]
    outlines: tuple[MapOutline, ...]


def cut_at_date_line(latitude: np.ndarray, longitude: np.ndarray) -> list[Line]:
    """The curve as lines of (longitude, latitude) that never leap from 180 to -180 degrees.

    Neighbouring points are less than half a turn apart; the latitude of a crossing is that of the straight line.
    """
    lines: list[Line] = [[]]
    for k, (north, east) in enumerate(zip(latitude.tolist(), longitude.tolist(), strict=True)):
        if k and abs(east - longitude[k - 1]) > 180.0:
            before, side = float(longitude[k - 1]), 180.0 if longitude[k - 1] > 0.0 else -180.0
            turn = east + 2.0 * side - before
            part = (side - before) / turn if turn else 0.0
            crossing = float(latitude[k - 1]) + part * (north - float(latitude[k - 1]))
            lines[-1].append((side, crossing))
            lines.append([(-side, crossing)])
        lines[-1].append((east, north))
    return [[(_degrees(east), _degrees(north)) for east, north in line] for line in lines if len(line) > 1]


def _degrees(value: float) -> float:
    return round(float(value), DECIMALS) + 0.0  # no minus zero


def geojson(places: Places) -> bytes:
    """A FeatureCollection: a point per case and named place, a (multi-)line per outline."""
    head = {"type": "FeatureCollection", "title": places.title, "description": places.note}
    features = ",\n".join(json.dumps(feature, ensure_ascii=False, allow_nan=False) for feature in _features(places))
    text = json.dumps(head, ensure_ascii=False)[:-1] + ', "features": [\n' + features + "\n]}\n"
    return text.encode("utf-8", errors="backslashreplace")  # a lone surrogate, as JSON writes it


def _features(places: Places) -> Iterator[dict[str, Any]]:
    for outline in places.outlines:
        lines = cut_at_date_line(outline.latitude, outline.longitude)
        kind, coordinates = ("LineString", lines[0]) if len(lines) == 1 else ("MultiLineString", lines)
        properties = {"kind": outline.kind, "name": outline.name, **outline.facts}
        yield _feature({"type": kind, "coordinates": coordinates}, properties)
    for mark in places.marks:
        yield _feature(_point(mark.latitude, mark.longitude), {"kind": "mark", "name": mark.name})
    for case, status, north, east in _cases(places):
        yield _feature(_point(north, east), {"kind": "case", "case_id": case, "status": status})


def _cases(places: Places) -> Iterator[tuple[int, str, float, float]]:
    rows = (places.case_ids.tolist(), places.status, places.latitude.tolist(), places.longitude.tolist())
    return zip(*rows, strict=True)


def _point(latitude: float, longitude: float) -> dict[str, Any]:
    return {"type": "Point", "coordinates": (_degrees(longitude), _degrees(latitude))}


def _feature(geometry: dict[str, Any], properties: dict[str, Any]) -> dict[str, Any]:
    return {"type": "Feature", "properties": properties, "geometry": geometry}


def kml(places: Places) -> bytes:
    """The same as a KML document: a folder of regions, one of named places, one of cases."""
    root = ElementTree.Element("kml", xmlns="http://www.opengis.net/kml/2.2")
    document = ElementTree.SubElement(root, "Document")
    _text(document, "name", places.title)
    _text(document, "description", places.note)
    for name, colour in COLOURS.items():
        _style(document, name, colour)
    _outline_folder(document, places)
    marks = _folder(document, "Named places")
    for mark in places.marks:
        _placemark(marks, mark.name, "mark", mark.latitude, mark.longitude)
    cases = _folder(document, "Cases")
    for case, status, north, east in _cases(places):
        placemark = _placemark(cases, f"case {case}", "case", north, east)
        _data(placemark, {"case_id": case, "status": status})
    ElementTree.indent(root, " ")
    text = ElementTree.tostring(root, encoding="unicode")
    return f'<?xml version="1.0" encoding="UTF-8"?>\n{text}\n'.encode()


def _outline_folder(document: ElementTree.Element, places: Places) -> None:
    folder = _folder(document, "Regions")
    for outline in places.outlines:
        placemark = ElementTree.SubElement(folder, "Placemark")
        _text(placemark, "name", outline.name)
        _text(placemark, "styleUrl", f"#{outline.kind}")
        _data(placemark, outline.facts)
        several = ElementTree.SubElement(placemark, "MultiGeometry")
        for line in cut_at_date_line(outline.latitude, outline.longitude):
            drawn = ElementTree.SubElement(several, "LineString")
            _text(drawn, "tessellate", "1")
            _text(drawn, "coordinates", " ".join(f"{east},{north}" for east, north in line))


def _style(document: ElementTree.Element, name: str, colour: str) -> None:
    style = ElementTree.SubElement(document, "Style", id=name)
    if name in ("case", "mark"):
        icon = ElementTree.SubElement(style, "IconStyle")
        _text(icon, "color", colour)
        _text(icon, "scale", "0.3" if name == "case" else "0.9")
        label = ElementTree.SubElement(style, "LabelStyle")
        _text(label, "scale", "0" if name == "case" else "0.8")  # ten thousand names would hide the map
    else:
        line = ElementTree.SubElement(style, "LineStyle")
        _text(line, "color", colour)
        _text(line, "width", "2")


def _folder(document: ElementTree.Element, name: str) -> ElementTree.Element:
    folder = ElementTree.SubElement(document, "Folder")
    _text(folder, "name", name)
    return folder


def _placemark(
    folder: ElementTree.Element, name: str, style: str, latitude: float, longitude: float
) -> ElementTree.Element:
    placemark = ElementTree.SubElement(folder, "Placemark")
    _text(placemark, "name", name)
    _text(placemark, "styleUrl", f"#{style}")
    point = ElementTree.SubElement(placemark, "Point")
    _text(point, "coordinates", f"{_degrees(longitude)},{_degrees(latitude)}")
    return placemark


def _data(placemark: ElementTree.Element, facts: dict[str, Any]) -> None:
    """ExtendedData, in its place before the geometry."""
    extended = ElementTree.Element("ExtendedData")
    for name, value in facts.items():
        _text(ElementTree.SubElement(extended, "Data", name=name), "value", str(value))
    placemark.insert(2, extended)


def _text(parent: ElementTree.Element, tag: str, text: str) -> None:
    # XML 1.0, section 2.2: other control characters cannot be written, not even as references.
    ElementTree.SubElement(parent, tag).text = re.sub("[\x00-\x08\x0b\x0c\x0e-\x1f\ud800-\udfff\ufffe\uffff]", "", text)
