"""Mistakes in the use of what `prepare` is handed, and in what it returns: a sentence with the line and the fix."""

import numpy as np
import pytest
from mistaken_campaign import campaign_with, given, line_of, with_input

from mc_engine.errors import EngineError
from mc_engine.flight.contract import breaches
from mc_engine.flight.flight import prepare

PREPARE = (
    "import numpy as np\n\n\ndef prepare(inputs, settings, refusals):\n    more = {{}}\n    {}\n"
    "    return {{**vars(inputs), **more}}\n\n\n@physics\ndef initial"
)


def campaign(folder, line):
    """The smallest campaign with a `prepare` that has this line, and with a setting."""
    return campaign_with(
        folder,
        ("@physics\ndef initial", PREPARE.format(line)),
        given("prepare=prepare"),
        *with_input('limit_s=Setting(10.0, "a limit")'),
    )


USE = (
    "`inputs` and `settings` have attributes in SI, without unit, such as inputs.altitude, and vars(inputs) is a "
    "dictionary of them; each holds the numbers of many cases: use NumPy, np.where(condition, a, b), & and |; "
    'cases are refused by refusals.add(mask, "why")'
)


def test_a_mistake_in_the_preparation_of_cases_is_a_sentence_with_its_fix(tmp_path):
    for line, sentence in [
        ('r = inputs["altitude"]', USE),
        ('inputs["altitude"] = 1.0', USE),
        ("more = {**inputs}", USE),
        ("r = inputs.altitud", f"no attribute 'altitud'; did you mean \"altitude\"?; {USE}"),
        ("r = inputs.altitude_km", f"no attribute 'altitude_km'; did you mean \"altitude\"?; {USE}"),
        ("r = settings.altitude", f"no attribute 'altitude'; known is \"limit\"; {USE}"),
        ('r = vars(inputs)["burn_dv_m_s"]', f"KeyError: 'burn_dv_m_s'; {USE}"),
        ("refusals.append(inputs.altitude < 0.0)", f"no attribute 'append'; {USE}"),
        ("refusals.add(inputs.altitude < 0.0)", f"missing 1 required positional argument: 'sentence'; {USE}"),
        ('refusals.add(None, "why")', USE),
        ('refusals.add(np.maximum(inputs.altitude - 1e9, 0.0), "why")', USE),
        ('refusals.add(np.zeros(7, dtype=bool), "why")', USE),
        ('refusals.reason[0] = "why"', f"assignment destination is read-only; {USE}"),
        ("r = 1.0 if inputs.altitude > 0.0 else 2.0", USE),
        ("import math; r = math.sqrt(inputs.altitude)", USE),
        ('more["altitude"] = inputs.altitude + 0j', '`prepare` gives "altitude" as complex numbers; it must be a num'),
        ('more["altitude"] = inputs.altitude[:1]', '`prepare` gives "altitude" as shape (1,); it must be a number for'),
        ('more["altitude"] = None', '`prepare` gives "altitude" as NoneType; it must be a number for each of 3 cases'),
        ('more["altitude"] = ["low"] * 3', '`prepare` gives "altitude" as an array of str96; it must be'),
        ('more["altitude"] = [[1.0], [1.0, 2.0]]', '`prepare` gives "altitude" as list; it must be a number for'),
    ]:
        try:
            (found,) = breaches(campaign(tmp_path, line))
        except EngineError as error:  # with one case alone, when the file is loaded
            found = str(error).splitlines()[-1].strip().removeprefix("campaign.model: ")
        assert sentence in found
        assert "\n" not in found
        place = "def prepare" if line.startswith("more[") else line
        assert found.startswith(f"model.py, line {line_of(tmp_path, place)}: `prepare`")


def test_a_mask_of_refused_cases_may_be_changed_in_place(tmp_path):
    assert breaches(campaign(tmp_path, "wrong = refusals.mask; wrong |= inputs.altitude < 0.0")) == []


def test_one_number_counts_for_all_cases_and_an_array_has_one_for_each(tmp_path):
    one = campaign(tmp_path, 'more = {"altitude": 4e5, "burn_dv": inputs.burn_dv + np.arange(5.0)}')
    altitude, burn, *_ = prepare(one.model, one.nominal, 5).parameters
    assert altitude.tolist() == [4e5] * 5
    assert np.diff(burn).tolist() == [1.0] * 4


def test_a_number_outside_of_the_bounds_of_an_input_is_told_with_its_unit_if_it_has_one(tmp_path):
    inputs = 'gain=Parameter(1.0, "a gain", 0.0, 2.0, unit=""), range_km=Parameter(1.0, "a range", 0.0, 2.0)'
    lost = campaign_with(tmp_path, *with_input(inputs))
    for name, words in [("gain", "gain is outside 0 to 2"), ("range_km", "range_km is outside 0 to 2 km")]:
        given = {**lost.nominal, name: np.array([1.0, 3.0])}
        assert prepare(lost.model, given, 2).refusals.reason.tolist() == ["", words]


def test_an_error_of_the_models_own_stays_what_it_is(tmp_path):
    with pytest.raises(EngineError, match=r"model\.py, line \d+: `prepare`: KeyError: 7"):
        campaign(tmp_path, "{}[7]")


def test_a_preparation_that_would_have_to_be_awaited_is_a_sentence(tmp_path):
    with pytest.raises(EngineError, match=r"model\.py, line \d+: `prepare` is an async def; write def"):
        campaign_with(
            tmp_path,
            (
                "@physics\ndef initial",
                "async def prepare(i, s, refusals):\n    return vars(i)\n\n\n@physics\ndef initial",
            ),
            given("prepare=prepare"),
        )
