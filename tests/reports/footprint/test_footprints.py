"""The footprint in the report, and beside it as KML and GeoJSON."""

import json
import re
from types import SimpleNamespace
from xml.etree import ElementTree

import numpy as np
import pytest
from figure_marks import marks_of
from landing_run import FOOTPRINT, landing_run

from reports import render_html, render_pdf
from reports.contents import build
from reports.document.blocks import FigureBlock, Table, Text
from reports.drawing import screen
from reports.drawing.marks import Line, Points
from reports.figures.footprints import footprint_plot, footprint_views
from reports.footprint.map_files import cut_at_date_line
from reports.footprint.section import _long_axis

KML = "{http://www.opengis.net/kml/2.2}"


@pytest.fixture(scope="module")
def document():
    return build(landing_run(), "run")


def blocks(document, kind):
    sections = [section for section in document.sections if section.anchor == "footprint"]
    return [block for section in sections for block in section.blocks if isinstance(block, kind)]


def sentences(document):
    return " ".join(paragraph for block in blocks(document, Text) for paragraph in block.paragraphs)


def impact_points(document):
    """Cases that came down, as the figure's key counts them."""
    return int(blocks(document, FigureBlock)[0].drawing.key[0].key.split(" of ")[0].replace("\u202f", ""))


def file(document, name):
    return next(one.content for one in document.files if one.name == name)


def test_the_drawing_counts_the_cases_that_came_down(document):
    drawing = blocks(document, FigureBlock)[0].drawing
    table = landing_run().table
    down = int((table["end_altitude_km"] < 30.0).sum())
    assert drawing.key[0].key.startswith(f"{down} of 1\u202f000 cases")
    above = int((table["end_altitude_km"] > 30.0).sum())
    assert f"{above} cases ended above 30\u202fkm" in blocks(document, FigureBlock)[0].caption


def test_a_footprint_across_the_date_line_is_one_cloud(document):
    drawing = blocks(document, FigureBlock)[0].drawing
    assert max(np.abs([cloud.x, cloud.y]).max() for cloud in marks_of(drawing, Points)) < 250.0  # km
    for panel in screen.specifications(drawing):
        json.dumps(panel, allow_nan=False)


def test_the_table_states_contents_and_counts_what_is_inside(document):
    regions, distances = blocks(document, Table)
    assert [row[1].text for row in regions.rows[:3]] == ["50\u202f%", "90\u202f%", "99\u202f%"]
    n = impact_points(document)
    for row in regions.rows:
        inside, tried = (int(part.replace("\u202f", "")) for part in row[2].text.split(" / "))
        assert tried == n
        assert row[3].value == pytest.approx(inside / n)
        assert row[3].value == pytest.approx(row[1].value, abs=0.06)
    assert [row[0].text for row in distances.rows] == ["mean impact point", "end of the nominal case"]
    assert distances.rows[0][1].text == f"{n} / 1\u202f000"


def test_kml_has_a_placemark_per_case_place_and_region(document):
    root = ElementTree.fromstring(file(document, "footprint.kml"))
    n = impact_points(document)
    folders = {one.find(f"{KML}name").text: one for one in root.iter(f"{KML}Folder")}
    cases = folders["Cases"].findall(f"{KML}Placemark")
    assert len(cases) == n
    assert len(folders["Regions"].findall(f"{KML}Placemark")) == len(blocks(document, Table)[0].rows)
    first = {data.get("name"): data.find(f"{KML}value").text for data in cases[0].iter(f"{KML}Data")}
    assert first == {"case_id": "0", "status": "ok"}
    east, north = (float(part) for part in cases[0].find(f".//{KML}coordinates").text.split(","))
    assert north == pytest.approx(landing_run().table["latitude_deg"][0], abs=1e-6)
    assert -180.0 <= east <= 180.0


def test_geojson_holds_the_same_and_no_line_leaps_over_the_date_line(document):
    collection = json.loads(file(document, "footprint.geojson"))
    assert collection["type"] == "FeatureCollection"
    kinds = [feature["properties"]["kind"] for feature in collection["features"]]
    assert kinds.count("case") == impact_points(document)
    assert kinds.count("ellipse") == 3
    lines = [one["geometry"] for one in collection["features"] if one["geometry"]["type"] == "MultiLineString"]
    assert lines
    for geometry in lines:
        for line in geometry["coordinates"]:
            assert np.abs(np.diff(np.array(line)[:, 0])).max() < 180.0


def test_a_line_over_the_date_line_is_cut_where_it_crosses():
    lines = cut_at_date_line(np.array([10.0, 20.0, 20.0]), np.array([179.0, -179.0, -178.0]))
    assert lines == [[(179.0, 10.0), (180.0, 15.0)], [(-180.0, 15.0), (-179.0, 20.0), (-178.0, 20.0)]]
    back = cut_at_date_line(np.array([0.0, 4.0]), np.array([-179.0, 178.0]))
    assert [part[-1] for part in back] == [(-180.0, pytest.approx(4.0 / 3.0)), (178.0, 4.0)]


def test_the_files_are_the_same_bytes_twice_and_stand_beside_the_report(document):
    again = build(landing_run(), "run")
    assert [(one.name, one.content) for one in again.files] == [(one.name, one.content) for one in document.files]
    assert [one.name for one in document.files] == ["footprint.kml", "footprint.geojson"]
    assert "footprint.kml and footprint.geojson beside this report hold all" in sentences(document)


def test_hostile_titles_stay_text_in_kml_and_geojson():
    hostile = FOOTPRINT | {"title": "</name><script>\x00\x1b alert(1) & ]]>"}
    document = build(landing_run(60, 2, figures=[hostile]), "run")
    root = ElementTree.fromstring(file(document, "footprint.kml"))
    assert "</name><script> alert(1) & ]]>" in root.find(f".//{KML}description").text
    assert json.loads(file(document, "footprint.geojson"))["description"].startswith(hostile["title"])


def test_distances_count_from_the_target_where_there_is_one():
    parameters = [{"name": "aim_latitude_deg", "value": 54.5}, {"name": "aim_longitude_deg", "value": -179.5}]
    figure = FOOTPRINT | {"target": ["aim_latitude_deg", "aim_longitude_deg"]}
    row = blocks(build(landing_run(figures=[figure], parameters=parameters), "run"), Table)[1].rows[0]
    assert row[0].text == "target"
    assert row[0].small == "54.5000° N, 179.5000° W"
    assert 30.0 < row[2].value < 90.0  # km; the cloud's middle is 68 km away


def test_another_planet_has_its_own_size_and_no_files_for_a_globe():
    settings = [{"name": "planet", "unit": "", "description": "", "value": "mars"}]
    on_mars = build(landing_run(settings=settings), "run")
    assert on_mars.files == ()
    axes = [float(blocks(one, Table)[0].rows[0][4].text.split()[0]) for one in (on_mars, build(landing_run(), "run"))]
    assert axes[0] / axes[1] == pytest.approx(3396.19 / 6378.0, rel=5e-3)


@pytest.mark.parametrize(("planet", "radius"), [("moon", 1737.4), ("titan", None)])
def test_landings_on_the_moon_have_its_size_and_those_on_an_unknown_planet_no_footprint(planet, radius):
    """Both had the ellipsoid of the Earth, and its coasts: regions on the Moon were 3.7 times too large."""
    settings = [{"name": "planet", "unit": "", "description": "", "value": planet}]
    document = build(landing_run(settings=settings), "run")
    assert document.files == ()
    if radius is None:
        assert "the size of “titan” is not known, only that of earth, mars, moon, venus." in sentences(document)
        return
    axes = [float(blocks(one, Table)[0].rows[0][4].text.split()[0]) for one in (document, build(landing_run(), "run"))]
    assert axes[0] / axes[1] == pytest.approx(radius / 6378.0, rel=5e-3)


def test_the_regions_have_the_confidence_of_the_report():
    """With `confidence = 0.99` under [report] they kept 90 %, and were too small for it."""
    inside = {}
    for confidence in (0.8, 0.99):
        document = build(landing_run(report={"probability": 0.9973, "confidence": confidence}), "run")
        rows = [row for row in blocks(document, Table)[0].rows if "distribution-free" in row[0].text]
        assert rows
        assert all(f"{100.0 * confidence:.0f}\u202f% confidence" in row[0].small for row in rows)
        inside[confidence] = rows[0][2].value
    assert inside[0.8] < inside[0.99]


def test_landings_on_several_planets_are_in_no_footprint_and_those_on_one_are_measured_on_it():
    """A grid over Mars and the Earth had one mean impact point, and the coasts and the size of the Earth."""
    figures = [FOOTPRINT | {"planet": "law"}]
    document = build(landing_run(laws=("mars", "earth"), figures=figures), "run")
    assert "Where the flights end: not drawn; the cases differ in the law." in sentences(document)
    assert document.files == ()
    run = landing_run(figures=figures)
    run.table["law"] = "mars"
    axes = [float(blocks(build(one, "run"), Table)[0].rows[0][4].text.split()[0]) for one in (run, landing_run())]
    assert axes[0] / axes[1] == pytest.approx(3396.19 / 6378.0, rel=5e-3)


def test_chosen_cases_have_points_and_no_regions():
    run = landing_run()
    run.manifest["campaign"]["design"] = "grid"
    document = build(run, "run")
    assert not marks_of(blocks(document, FigureBlock)[0].drawing, Line, "5")
    assert not marks_of(blocks(document, FigureBlock)[0].drawing, Line, "CEP")
    assert "No regions: the cases of the design “grid” are chosen, not drawn." in sentences(document)
    assert "outlines" not in sentences(document)
    distances = next(one for one in blocks(document, Table) if one.caption == "Distances along the ground")
    assert [column.title for column in distances.columns] == ["Distance from", "Used / tried", "Largest [km]"]


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda table: table.assign(status="not-finite"), "none of 50 cases has an impact point."),
        pytest.param(
            lambda table: table.assign(latitude_deg=np.nan), "none of 50 cases has an impact point.",
            marks=pytest.mark.slow,
        ),
        (lambda table: table.assign(end_altitude_km=99.0), "an impact point; 49 ended above 30\u202fkm."),
        (lambda table: table.assign(latitude_deg=1.0, longitude_deg=2.0), "impact points lie within one metre"),
        (lambda table: table.head(1), "No regions: they need three impact points, and there are 1."),
        pytest.param(
            lambda table: table.head(2), "No regions: they need three impact points, and there are 2.",
            marks=pytest.mark.slow,
        ),
        (lambda table: table.assign(latitude_deg=0.0), "impact points lie on a line."),
        (lambda table: table.assign(latitude_deg=0.0, longitude_deg=7.2 * table["case_id"]), "too far apart"),
        (lambda table: table.drop(columns="latitude_deg"), "not drawn; the run has no column latitude_deg."),
    ],
)  # fmt: skip
def test_what_cannot_be_drawn_is_said(change, said):
    run = landing_run(50, 1)
    run.table = change(run.table)
    document = build(run, "run")
    assert said in sentences(document)
    assert render_html(document).startswith(b"<!doctype html>")
    assert render_pdf(document).startswith(b"%PDF")


def test_no_path_gets_into_the_files(document):
    for one in document.files:
        assert not re.search(rb"/(tmp|home|work|root)/", one.content)


@pytest.mark.parametrize(("semi_axes", "enlarged"), [((70e3, 9.5e3), False), ((130e3, 10e3), True)])
def test_a_scale_of_its_own_across_is_for_clouds_far_longer_than_wide(semi_axes, enlarged):
    found = SimpleNamespace(ellipses=[SimpleNamespace(semi_axes=semi_axes, direction=0.3)])
    assert (_long_axis(found) is not None) == enlarged


def test_a_view_with_two_scales_says_so():
    points = np.array([[0.0, 0.0], [3.0, 4.0]])
    cloud = Points(*points.T, "", texts=["a", "b"], cases=np.arange(2))
    views = [footprint_plot(view, cloud, (2, 2)) for view in footprint_views(0.3)]
    assert [(plot.equal, plot.title) for plot in views[:2]] == [
        (True, ""),
        (False, "Each axis has a scale of its own"),
    ]
