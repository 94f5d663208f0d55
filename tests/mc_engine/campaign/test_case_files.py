import numpy as np
import pandas
import pytest
from toy import HERE, load, problems

from mc_engine.campaign.tables_beside import empirical_numbers, read_columns
from mc_engine.model.files import FileFault
from mc_engine.sampling.distributions import Empirical


def write(folder, name, text):
    path = folder / name
    path.write_text(text)
    return path


def test_the_numbers_of_a_column_come_back_sorted(tmp_path):
    path = write(tmp_path, "m.csv", "a,b\n3,1\n\n2,x\n")
    assert empirical_numbers(path, "a") == (2.0, 3.0)
    assert empirical_numbers(write(tmp_path, "n.csv", "3\n1\n2\n"), None) == (1.0, 2.0, 3.0)  # without a name


def test_a_byte_order_mark_and_windows_line_ends_do_no_harm(tmp_path):
    path = tmp_path / "m.csv"
    path.write_bytes(b"\xef\xbb\xbfa\r\n1\r\n2\r\n")
    assert empirical_numbers(path, "a") == (1.0, 2.0)


def test_parquet_serves_as_well(tmp_path):
    pandas.DataFrame({"a": [3.0, 1.0], "b": [1, 2]}).to_parquet(tmp_path / "m.parquet")
    assert empirical_numbers(tmp_path / "m.parquet", "a") == (1.0, 3.0)


def test_a_faulty_file_is_refused_with_row_and_column(tmp_path):
    for text, column, message in [
        ("", None, "is empty"),
        ("a\n", None, "has no numbers below its first line"),
        ("a,b\n1,2\n", None, "has 2 columns; say which"),
        ("a,b\n1,2\n", "c", 'has no column "c"; it has a, b'),
        ("a,a\n1,2\n", "a", 'has the column "a" twice'),
        ("a;b\n1,5;2\n", "a", "has semicolons or tabs between its columns; put commas there, and points in numbers"),
        ("a,\n1,2\n", "a", "a column without a name"),
        ("a,b\n1\n", "a", "line 2: 1 field; its first line names 2 columns"),
        ("a\n1\nx\n", None, 'row 2, column "a": "x" is not a finite number'),
        ("a\n1\nnan\n", None, 'row 2, column "a": "nan" is not a finite number'),
        ('a\n"1\n', None, "is not CSV text"),
        ("1,2\n3,4\n", None, '"m.csv" has numbers in its first line; put a line with the names of the columns first'),
        ("1,2\n3,4\n", "1", "has numbers in its first line"),
        ("1\n3\n", "1", "has numbers in its first line"),
    ]:
        with pytest.raises(FileFault, match=message):
            empirical_numbers(write(tmp_path, "m.csv", text), column)


def test_a_name_in_a_parquet_file_is_none_of_its_numbers(tmp_path):
    pandas.DataFrame({"7": [1.0, 3.0]}).to_parquet(tmp_path / "m.parquet")
    for column in (None, "7"):
        assert empirical_numbers(tmp_path / "m.parquet", column) == (1.0, 3.0)


def test_files_that_are_not_what_they_say_are_refused(tmp_path):
    (tmp_path / "m.csv").write_bytes(b"\xff\xfe\x00")
    for path in (write(tmp_path, "m.xlsx", "x"), write(tmp_path, "m.parquet", "x"), tmp_path / "m.csv"):
        with pytest.raises(FileFault, match=f'"{path.name}"'):
            read_columns(path)


BODY = '[dispersion.height_km]\ndist = "empirical"\nfile = "m.csv"\n'


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "toy.py").write_text((HERE / "toy.py").read_text())
    write(tmp_path, "m.csv", "h\n9000\n11000\n10000\n")
    return tmp_path


def test_an_empirical_dispersion_repeats_measured_values_in_the_parameters_unit(folder):
    campaign = load(BODY + 'unit = "m"', directory=folder)
    assert campaign.dispersions[0].distribution == Empirical((9.0, 10.0, 11.0))
    (folder / "m.csv").write_text((folder / "m.csv").read_text().replace("9000", "9001"))
    assert load(BODY + 'unit = "m"', directory=folder).digest != campaign.digest


def test_an_empirical_dispersion_that_cannot_be_drawn_is_refused(folder):
    for body, place, message in [
        (BODY.replace("m.csv", "n.csv"), "file", 'there is no file "n.csv" beside the campaign file'),
        (BODY + "lower = 20000", "lower", "the bounds leave none of the 3 numbers"),
        (BODY.replace("height_km", "angle_deg"), "", "reaches 9000 to 11000; the model accepts 0 to 90 deg"),
    ]:
        messages = problems(body, directory=folder)
        assert list(messages.values()) == [message]
        assert next(iter(messages)).endswith(place)


def test_integers_and_text_in_parquet_are_read_or_refused(tmp_path):
    frame = pandas.DataFrame({"n": [1, 2], "t": ["x", "y"], "b": [True, False], "gap": [1.0, np.nan]})
    frame.to_parquet(tmp_path / "m.parquet")
    assert empirical_numbers(tmp_path / "m.parquet", "n") == (1.0, 2.0)
    for column in ("t", "b", "gap"):
        with pytest.raises(FileFault, match=f'column "{column}"'):
            empirical_numbers(tmp_path / "m.parquet", column)
