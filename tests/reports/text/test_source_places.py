"""Tables of a source do not read like tables of the report."""

import pytest

from reports.text.source_places import of_source


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("Table 5", "Table 5 of the source"),
        ("Table 12, worst of 100", "Table 12 of the source, worst of 100"),
        ("section 8.1: thrust 0.5 %", "section 8.1 of the source: thrust 0.5 %"),
        ("the thrusters of Table 8; outside", "the thrusters of Table 8 of the source; outside"),
        ("from Table 9 to Table 1", "from Table 9 of the source to Table 1 of the source"),
        ("text on Figs 6 and 7", "text on Figs 6 and 7 of the source"),
        *(
            (same, same)
            for same in ("Vallado, Table 8-4", "Table 12 of Vallado", "the paper", "eq. 5", "table of trials")
        ),
    ],
)
def test_a_place_without_its_source_is_said_to_be_of_the_source(text, told):
    assert of_source(text) == told
    assert of_source(told) == told
