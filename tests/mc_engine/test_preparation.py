"""Mistakes in the use of what `prepare` is handed, and in what it returns: a sentence with the line and the fix."""

import numpy as np
import pytest
from mistaken_campaign import campaign_with, line_of

from mc_engine.errors import EngineError
from mc_engine.flight import prepare
from mc_engine.model_contract import breaches

PREPARE = (
    "import numpy as np\n\n\ndef prepare(inputs, settings, refusals):\n    more = {{}}\n    {}\n"
    "    return {{**vars(inputs), **more}}\n\n\n@physics\ndef initial"
)
SETTING = 'Setting("limit_s", "s", "a limit", 10.0),'


def campaign(folder, line):
    """The smallest campaign with a `prepare` that has this line, and with a setting."""
    return campaign_with(
        folder,
        ("@physics\ndef initial", PREPARE.format(line)),
        ("    initial=initial", "    prepare=prepare,\n    initial=initial"),
        ("    settings=()", f"    settings=({SETTING})"),
        ("Model, Parameter", "Model, Parameter, Setting"),
    )


ATTRIBUTES = "inputs and settings are attributes, as in inputs.altitude; vars(inputs) is a dictionary of them all"
REFUSE = 'cases are refused by refusals.add(mask, "why they cannot start")'


@pytest.mark.parametrize(
    ("line", "sentence"),
    [
        ('r = inputs["altitude"]', ATTRIBUTES),
        ('inputs["altitude"] = 1.0', ATTRIBUTES),
        ("more = {**inputs}", ATTRIBUTES),
        ("r = inputs.altitud", 'there is no "altitud" here; did you mean "altitude"?'),
        ("r = inputs.altitude_km", 'there is no "altitude_km" here; it is inputs.altitude, without its unit and in SI'),
        ("r = inputs.limit", 'there is no "limit" here; it is settings.limit'),
        ("r = settings.altitude", 'there is no "altitude" here; it is inputs.altitude'),
        ('r = vars(inputs)["burn_dv_m_s"]', 'there is no "burn_dv_m_s" here; it is inputs.burn_dv, without its unit'),
        ("refusals.append(inputs.altitude < 0.0)", REFUSE),
        ("refusals.add(inputs.altitude < 0.0)", REFUSE),
        ("r = 1.0 if inputs.altitude > 0.0 else 2.0", "use np.where(condition, a, b), and & | ~"),
        ("import math; r = math.sqrt(inputs.altitude)", "take it from NumPy"),
        ('more["altitude"] = inputs.altitude + 0j', '`prepare` gives "altitude" as complex numbers; it must be a num'),
        ('more["altitude"] = inputs.altitude[:1]', '`prepare` gives "altitude" as shape (1,); it must be a number for'),
        ('more["altitude"] = None', '`prepare` gives "altitude" as NoneType; it must be a number for each of 3 cases'),
        ('more["altitude"] = ["low"] * 3', '`prepare` gives "altitude" as an array of str96; it must be'),
        ('more["altitude"] = [[1.0], [1.0, 2.0]]', '`prepare` gives "altitude" as list; it must be a number for'),
    ],
)
def test_a_mistake_in_the_preparation_of_cases_is_a_sentence_with_its_fix(tmp_path, line, sentence):
    try:
        (found,) = breaches(campaign(tmp_path, line))
    except EngineError as error:  # with one case alone, when the file is loaded
        found = str(error).splitlines()[-1].strip().removeprefix("campaign.model: ")
    assert sentence in found
    assert "\n" not in found
    place = "def prepare" if line.startswith("more[") else line
    assert found.startswith(f"model.py, line {line_of(tmp_path, place)}: `prepare`")


def test_one_number_counts_for_all_cases_and_an_array_has_one_for_each(tmp_path):
    one = campaign(tmp_path, 'more = {"altitude": 4e5, "burn_dv": inputs.burn_dv + np.arange(5.0)}')
    altitude, burn, *_ = prepare(one.model, one.nominal, 5).parameters
    assert altitude.tolist() == [4e5] * 5
    assert np.diff(burn).tolist() == [1.0] * 4


def test_an_error_of_the_models_own_stays_what_it_is(tmp_path):
    with pytest.raises(EngineError, match=r"model\.py, line \d+: KeyError: 7"):
        campaign(tmp_path, "{}[7]")


def test_a_preparation_that_would_have_to_be_awaited_is_a_sentence(tmp_path):
    with pytest.raises(EngineError, match=r"model\.py, line \d+: `prepare` is an async def; write def"):
        campaign_with(
            tmp_path,
            (
                "@physics\ndef initial",
                "async def prepare(i, s, refusals):\n    return vars(i)\n\n\n@physics\ndef initial",
            ),
            ("    initial=initial", "    prepare=prepare,\n    initial=initial"),
        )
