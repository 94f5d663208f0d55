"""Widths of the columns of a printed table, and what stays on one line."""

import pytest

from reports.document.blocks import Cell, Column, Table
from reports.document.columns import INSET, NO_BREAK, ROOM, unbroken, widths
from reports.drawing import lettering
from reports.drawing.lettering import TYPE


def table(n_columns, text):
    columns = (Column("Metric", "text"), *(Column("Effect", "number") for _ in range(n_columns)))
    return Table("Effects", columns, ((Cell("heat load"), *(Cell(text) for _ in range(n_columns))),))


@pytest.mark.parametrize("text", ["0.99 [0.97, 1.00]", "10\u202f000 / 10\u202f000"])
def test_an_interval_and_a_count_are_not_broken(text):
    joined = unbroken(table(3, text))
    value = joined.rows[0][1].text
    assert value.replace(NO_BREAK, " ") == text
    pieces = value.split(" ")
    assert not any("[" in piece and "]" not in piece for piece in pieces)
    assert not any(piece in ("/", text.split(" ")[0]) and "/" in text for piece in pieces)
    longest = max(lettering.width(piece, TYPE) for piece in pieces)
    assert all(width >= longest + INSET for width in widths(joined)[1:])


def test_they_are_broken_where_the_page_has_no_room_for_them():
    crowded = table(12, "0.99 [0.97, 1.00]")
    assert unbroken(crowded) is crowded
    assert sum(widths(crowded)) <= ROOM + 1e-6


def test_words_that_are_held_together_are_not_taken_for_two():
    """The head “Std. dev.” over narrow numbers once ran into the column before."""
    head = f"Std.{NO_BREAK}dev."
    columns = (Column("Metric", "text"), Column(head, "number"))
    narrow = Table("Statistics", columns, tuple((Cell("a long name of a metric " * 6), Cell("1")) for _ in range(9)))
    assert widths(narrow)[1] >= lettering.width(head, TYPE) + INSET


def test_a_count_is_broken_before_its_stroke_where_the_text_beside_it_then_takes_fewer_lines():
    """At 10 000 cases the limits of a verification matrix once had less of the width than the counts beside them."""
    counted = Cell("10\u202f000 / 10\u202f000")
    columns = (Column("Requirement", "text"), *(Column("Inside / tried", "number") for _ in range(5)))
    long = Cell("a limit with its confidence and its source " * 3)
    crowded, short = (
        unbroken(Table("Limits", columns, ((cell, *[counted] * 5),) * 3)) for cell in (long, Cell("load"))
    )
    assert crowded.rows[0][1].text == f"10\u202f000 /{NO_BREAK}10\u202f000"
    assert short.rows[0][1].text == f"10\u202f000{NO_BREAK}/{NO_BREAK}10\u202f000"
