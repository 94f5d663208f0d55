"""The section on a run of design saltelli or morris."""

import numpy as np
import pytest
from synthetic_run import SyntheticRun, fly, synthetic_run

from mc_engine.sampling.designs import unit_cube
from reports.contents import build
from reports.document.blocks import FigureBlock, Table, blocks_of
from reports.formats.json_data import run_data
from reports.run.flown import Flown
from reports.sections.map_blocks import map_blocks


def designed(design, n_cases=600, lost=()):
    made = synthetic_run(n_cases, failed=0)
    ve, oe = (40.0 * (u - 0.5) for u in unit_cube(design, 1, ("ve_pct", "oe_pct"), np.arange(n_cases), n_cases))
    table = made.table.assign(ve_pct=ve, oe_pct=oe, **fly(ve, oe))
    table.loc[list(lost), "status"] = "not-finite"
    manifest = {**made.manifest, "campaign": {**made.manifest["campaign"], "design": design, "cases": n_cases}}
    return SyntheticRun(manifest, table, made.nominal_row, made.history)


def section(run):
    (found,) = [one for one in build(run, "run").sections if one.anchor == "drivers"]
    return found.blocks


@pytest.mark.parametrize(("design", "size", "word"), [("saltelli", 4, "blocks"), ("morris", 3, "trajectories")])
def test_indices_stand_in_a_table_that_counts_whole_blocks(design, size, word):
    blocks = section(designed(design, lost=(0, 50)))
    (table,) = [block for block in blocks if isinstance(block, Table)]
    propellant = [row for row in table.rows if row[0].text.startswith("propellant")]
    assert [row[1].text for row in propellant] == ["ve", "oe"]
    assert propellant[0][0].small == f"{600 // size - 2} / {600 // size} {word}"
    assert propellant[0][2].value > propellant[1][2].value > 0.0
    assert propellant[0][2].small.startswith("± ")
    assert sum(isinstance(block, FigureBlock) for block in blocks) == (design == "saltelli")
    assert "Random draws in flight " in table.note
    assert ("below 0 or above 1 it is an error of the estimate" in table.note) == (design == "saltelli")


def test_an_input_that_is_also_in_the_histories_keeps_its_place_in_the_blocks():
    """It came first in the report's list of inputs, and the indices of each input were given to another one."""
    run = designed("saltelli")
    expected = Flown(run, "run").contributions.by_metric["propellant_kg"]
    oe = next(column for column in run.manifest["columns"] if column["name"] == "oe_pct")
    both = SyntheticRun(
        {**run.manifest, "quantities": [{**oe, "role": "output"}]}, run.table, run.nominal_row, run.history
    )
    assert Flown(both, "run").contributions.by_metric["propellant_kg"] == expected


def test_the_caption_says_of_how_many_blocks_the_metrics_with_fewest_and_most_numbers_are():
    """It named the fewest alone, as if every metric had lost the blocks in which one of them has no number."""
    run = designed("saltelli")
    run.table.loc[:79, "propellant_kg"] = np.nan
    (figure,) = [block for block in section(run) if isinstance(block, FigureBlock)]
    assert figure.caption.endswith("from 130 to 150 of 150 blocks of the design.")


def test_too_few_blocks_are_a_sentence():
    blocks = section(designed("saltelli", 16))
    assert not [block for block in blocks if isinstance(block, Table)]
    assert "fewer than 10 whole blocks" in blocks[0].paragraphs[0]


def test_effects_that_are_all_the_same_have_no_deviation_of_rounding():
    """Of a metric that is linear in both inputs σ of the effects was 3.3e-15."""
    run = designed("morris")
    run.table["settling_time_s"] = 1e3 + run.table["ve_pct"] / 3.0 + run.table["oe_pct"] / 7.0
    blocks = section(run)
    (table,) = [block for block in blocks if isinstance(block, Table)]
    linear = [row for row in table.rows if row[0].text.startswith("settling")]
    assert [row[4].text for row in linear] == ["0", "0"]
    assert [row[2].small for row in linear] == ["± 0", "± 0"]


def test_the_indices_of_saltelli_are_data_too():
    (table,) = [block for block in section(designed("saltelli")) if isinstance(block, Table)]
    records = {(one.metric, one.input): one for one in run_data(Flown(designed("saltelli"), "run"))["contributors"]}
    strongest = records["propellant_kg", "ve_pct"]
    assert (strongest.first, strongest.total) == pytest.approx([cell.value for cell in table.rows[0][2:]])
    half = float(table.rows[0][3].small.removeprefix("± "))
    assert strongest.total_interval[1] - strongest.total == pytest.approx(half, rel=0.1)


def test_metrics_that_have_no_row_are_counted_and_those_of_saltelli_are_data():
    """Without a requirement or a figure a metric was left out, without a word, of the report and of its data."""
    told = {design: section(designed(design))[-2].paragraphs[0] for design in ("saltelli", "morris")}
    assert told["saltelli"] == "The effects on 4 other metrics are in report.json."
    assert told["morris"].startswith("The effects on 4 other metrics are not shown;")
    flown = Flown(designed("saltelli"), "run")
    assert {one.metric for one in run_data(flown)["contributors"]} == {*flown.summaries}


def test_of_very_many_blocks_only_the_metrics_that_matter_have_indices(monkeypatch):
    """SALib's intervals take seconds for each metric then."""
    monkeypatch.setattr("reports.run.contributions.MOST_VALUES", 600 * 7)
    flown = Flown(designed("saltelli"), "run")
    assert [*flown.contributions.by_metric] == flown.key_metrics[:8] != [*flown.summaries]
    assert section(designed("saltelli"))[-2].paragraphs[0].startswith("The effects on 4 other metrics are not shown;")


def test_cases_of_a_block_at_one_place_count_once_in_a_map():
    """They differ in other inputs one by one; as independent cases they gave a map of their noise."""
    run = designed("saltelli")
    ve, oe = (np.repeat(run.table[name][:120], 5).to_numpy() for name in ("ve_pct", "oe_pct"))
    table = run.table.assign(ve_pct=ve, oe_pct=oe, **fly(ve, oe))
    flown = Flown(SyntheticRun(run.manifest, table, run.nominal_row, run.history), "run")
    (drawn, *_) = [block.drawing.alternative for block in map_blocks(flown) if isinstance(block, FigureBlock)]
    assert "nearest of 120 of 600 cases" in drawn


def one_at_a_time():
    """Cases 1 to 3 change ve alone, 4 and 5 oe alone; case 3 has no number."""
    made = synthetic_run(6, failed=0)
    ve, oe = np.array([0.0, -10.0, 20.0, 30.0, 0.0, 0.0]), np.array([0.0, 0.0, 0.0, 0.0, -5.0, 5.0])
    table = made.table.assign(ve_pct=ve, oe_pct=oe, **fly(ve, oe))
    table.loc[3, "status"] = "not-finite"
    table["entry_speed_m_s"] = 7000.0 + ve - 3.0 * np.abs(oe)
    manifest = {**made.manifest, "campaign": {**made.manifest["campaign"], "design": "one_at_a_time"}}
    return SyntheticRun(manifest, table, {**made.nominal_row, "ve_pct": 0.0, "oe_pct": 0.0}, made.history)


def test_one_at_a_time_tells_what_each_input_does_alone():
    run = one_at_a_time()
    run.manifest["requirements"] = [
        {"name": metric, "metric": metric, "at_least": 0.0, "share": 0.9, "confidence": 0.9}
        for metric in ("entry_speed_m_s", "pulse_count")
    ]
    run.table["pulse_count"] = 4.0
    figure, table, same, others = section(run)
    assert isinstance(figure, FigureBlock)
    assert same.paragraphs[0].startswith("No input alone changes pulse count by more than rounding, 1·10⁻¹³ of ")
    assert others.paragraphs[0].endswith(
        "other metrics are not shown; metrics with a requirement or in a figure come first."
    )
    rows = [row for row in table.rows if row[0].text == "entry speed [m/s]"]
    said = [tuple((cell.text, cell.small.replace("\u202f", " ")) for cell in row[1:]) for row in rows]
    assert said == [
        (("ve", ""), ("−10", "at −10 %"), ("20", "at 20 %"), ("2/3", "")),
        (("oe", ""), ("−15", "at −5 %"), ("0", ""), ("2/2", "")),
    ]


def test_one_at_a_time_ranks_inputs_by_what_each_changes_alone_in_the_tables_of_worst_cases_too():
    """Six cases are too few for shares of a variance: the inputs came in the order of the file."""
    run = one_at_a_time()
    run.table["entry_speed_m_s"] = 7000.0 + run.table["ve_pct"] - 10.0 * np.abs(run.table["oe_pct"])
    run.manifest["requirements"] = [
        {"name": "speed", "metric": "entry_speed_m_s", "at_least": 0.0, "share": 0.9, "confidence": 0.9}
    ]
    document = build(run, "run")
    (table,) = [block for block in blocks_of(document, Table) if block.caption == "Cases with the smallest entry speed"]
    assert [column.title for column in table.columns[3:5]] == ["oe [%]", "ve [%]"]
    (changes,) = [block for block in section(run) if isinstance(block, Table)]
    assert [row[1].text for row in changes.rows if row[0].text == "entry speed [m/s]"] == ["oe", "ve"]


def test_one_at_a_time_without_a_nominal_number_has_no_changes():
    run = one_at_a_time()
    run.table.loc[0, "status"] = "not-finite"
    words, *_ = section(run)
    assert words.paragraphs[0].startswith("Changes of propellant, ")


def test_an_input_without_a_number_keeps_its_row_and_rounding_is_no_change():
    run = one_at_a_time()
    run.table.loc[[4, 5], "status"] = "not-finite"
    run.table["propellant_kg"] = 1.5 + 1e-14 * run.table["case_id"]
    blocks = section(run)
    (table,) = [block for block in blocks if isinstance(block, Table)]
    (row,) = [row for row in table.rows if row[0].text == "peak force [N]" and row[1].text == "oe"]
    assert [cell.text for cell in row[2:]] == ["–", "–", "0/2"]
    assert "No input alone changes propellant" in blocks[-2].paragraphs[0]
