"""Covariances of orbit messages in, end states out."""

import csv
import re
import shutil
from pathlib import Path

import numpy as np
import pytest

import mc_engine
from mc_engine import load_campaign, open_store
from mc_engine.campaign.cases import case_table
from mc_engine.campaign.orbit_messages import AXES, MessageFault, read_message
from mc_engine.errors import CampaignError
from mc_engine.runner import runner
from mc_engine.sampling.correlation import normal_correlation
from tests.mc_engine.command_line.cart import call, fails_with

# The example OPM of CCSDS 502.0-B, annex: state [km, km/s] and lower triangle of the covariance [km, km/s].
STATE = (6655.9942, -40218.5751, -82.9177, 3.11548208, 0.47042605, -0.00101495)
TRIANGLE = """
3.331349476038534e-04
4.618927349220216e-04 6.782421679971363e-04
-3.070007847730449e-04 -4.221234189514228e-04 3.231931992380369e-04
-3.349365033922630e-07 -4.686084221046758e-07 2.484949578400095e-07 4.296022805587290e-10
-2.211832501084875e-07 -2.864186892102733e-07 1.798098699846038e-07 2.608899201686016e-10 1.767514756338532e-10
-3.041346050686871e-07 -4.989496988610662e-07 3.540310904497689e-07 1.869263192954590e-10 1.008862586240695e-10 6.224444338635500e-10
"""  # noqa: E501
ROWS = [[float(word) for word in line.split()] for line in TRIANGLE.split("\n") if line]
MATRIX = np.array([[ROWS[max(i, j)][min(i, j)] for j in range(6)] for i in range(6)])
NAMES = ("x_m", "y_m", "z_m", "vx_m_s", "vy_m_s", "vz_m_s")
IN_METRES = 1e3  # km to m, km/s to m/s

MODEL = """
from mc_engine.lanes import physics
from mc_engine.model import FixedStep, Parameter, at_end, inputs, metrics, model, outputs, states

NAMES = ("x_m", "y_m", "z_m", "vx_m_s", "vy_m_s", "vz_m_s")
Inputs = inputs(**{f"d{name}": Parameter(0.0, name) for name in NAMES})
State = states(**{name: name for name in NAMES})
Outputs = outputs(x_m="x")
Metrics = metrics(x_m=at_end("x_m", "x"))


@physics
def initial(p):
    return State(x=p.dx, y=p.dy, z=p.dz, vx=p.dvx, vy=p.dvy, vz=p.dvz)


@physics
def rhs(s):
    return State(x=s.vx, y=s.vy, z=s.vz, vx=0.0, vy=0.0, vz=0.0)


@physics
def observe(s):
    return Outputs(x=s.x)


MODEL = model(
    name="drift", title="A drift without forces", inputs=Inputs, states=State, outputs=Outputs, metrics=Metrics,
    clock=FixedStep(1.0, 10.0), initial=initial, rhs=rhs, observe=observe,
)
"""
CAMPAIGN = """
[campaign]
model = "model.py"
cases = 20
design = "mc"
seed = 7

[covariance.launch]
file = "state.opm"
parameters = ["dx_m", "dy_m", "dz_m", "dvx_m_s", "dvy_m_s", "dvz_m_s"]
frame = "EME2000"
"""


def opm(covariance_frame=""):
    """The example as a message."""
    facts = {"CCSDS_OPM_VERS": "3.0", "REF_FRAME": "EME2000", "EPOCH": "1998-12-18T14:28:15.1172"}
    units = 3 * ["km"] + 3 * ["km/s"]
    facts |= {name: f"{value} [{unit}]" for name, value, unit in zip(AXES, STATE, units, strict=True)}
    facts |= {"COV_REF_FRAME": covariance_frame} if covariance_frame else {}
    facts |= {f"C{a}_{b}": MATRIX[i, j] for i, a in enumerate(AXES) for j, b in enumerate(AXES[: i + 1])}
    return "\n".join(f"{key} = {value}" for key, value in facts.items())


def oem(*epochs):
    """The example as an ephemeris with a covariance in RTN at each epoch, and a state at the first."""
    state = " ".join(map(str, STATE))
    blocks = "\n".join(f"EPOCH = {epoch}\nCOV_REF_FRAME = RTN\n{TRIANGLE}" for epoch in epochs)
    return f"""CCSDS_OEM_VERS = 3.0
META_START
REF_FRAME = EME2000
META_STOP
COMMENT one point
{epochs[0]} {state}
COVARIANCE_START
{blocks}
COVARIANCE_STOP"""


@pytest.fixture
def folder(tmp_path):
    """A campaign whose spread is the example's covariance."""
    for name, text in {"model.py": MODEL, "campaign.toml": CAMPAIGN, "state.opm": opm()}.items():
        (tmp_path / name).write_text(text)
    return tmp_path


def campaign_covariance(campaign):
    """float64[6, 6] in SI, of the normal deviates that the campaign draws."""
    # where a parameter has a range, the normal is cut to it
    normals = [getattr(one.distribution, "base", one.distribution) for one in campaign.dispersions]
    sigma = np.array([one.sigma for one in normals])
    names = [one.name for one in campaign.dispersions]
    matrix = np.eye(6)
    for one in campaign.correlations:
        i, j = names.index(one.first), names.index(one.second)
        matrix[i, j] = matrix[j, i] = normal_correlation(one.rank)
    return matrix * np.outer(sigma, sigma)


def test_the_campaign_draws_with_the_covariance_of_the_message(folder):
    campaign = load_campaign(folder)
    wanted = MATRIX * IN_METRES**2
    assert np.allclose(campaign_covariance(campaign), wanted, rtol=1e-12, atol=0.0)
    drawn = np.column_stack(list(case_table(campaign, np.arange(100_000)).values()))
    # the standard error of a sample covariance of normal deviates; five of them for each of 36 numbers
    error = np.sqrt((wanted**2 + np.outer(np.diag(wanted), np.diag(wanted))) / 100_000)
    assert (np.abs(np.cov(drawn.T) - wanted) < 5.0 * error).all()


@pytest.mark.parametrize(("frame", "first"), [("RTN", STATE[:3]), ("TNW", STATE[3:])])
def test_local_axes_lie_along_radius_or_velocity_and_the_normal(frame, first):
    turned = read_message(opm())[0].covariance_in(frame)
    along = np.array(first) / np.linalg.norm(first)
    normal = np.cross(STATE[:3], STATE[3:])
    normal /= np.linalg.norm(normal)
    for place, axis in ((0, along), (2, normal)):
        assert turned[place, place] == pytest.approx(axis @ MATRIX[:3, :3] @ axis, rel=1e-9)
        assert turned[place + 3, place] == pytest.approx(axis @ MATRIX[3:, :3] @ axis, rel=1e-9)
    assert np.allclose(np.linalg.eigvalsh(turned[:3, :3]), np.linalg.eigvalsh(MATRIX[:3, :3]), rtol=1e-6)


def test_an_ephemeris_has_a_covariance_an_epoch():
    first, second = read_message(oem("1998-12-18T14:28:15", "1998-352T15:00:00.0"))
    assert np.array_equal(first.covariance_in("RTN"), MATRIX)
    assert first.covariance_in("TNW").shape == (6, 6)
    with pytest.raises(MessageFault, match="no state at 1998-352T15"):
        second.covariance_in("TNW")


def test_a_covariance_without_a_frame_is_in_that_of_its_segment_whatever_frame_the_one_before_has():
    epochs = ("1998-12-18T14:28:15", "1998-12-18T15:28:15", "1998-12-18T16:28:15")
    head, one, two, three = oem(*epochs).split("EPOCH = ")
    text = "EPOCH = ".join([head, one, two.replace("COV_REF_FRAME = RTN\n", ""), three])
    assert [state.covariance_frame for state in read_message(text)] == ["RTN", "EME2000", "RTN"]


def test_the_frame_of_a_covariance_may_stand_before_its_epoch():
    """It was overlooked, and the covariance taken as one in the frame of the segment."""
    text = oem("1998-12-18T14:28:15", "1998-12-18T15:28:15", "1998-12-18T16:28:15")
    turned = re.sub("(EPOCH = .*\n)(COV_REF_FRAME = RTN\n)", r"\2\1", text)
    assert [state.covariance_frame for state in read_message(turned)] == 3 * ["RTN"]
    without = turned.replace("COV_REF_FRAME = RTN\nEPOCH = 1998-12-18T15", "EPOCH = 1998-12-18T15")
    assert [state.covariance_frame for state in read_message(without)] == ["RTN", "EME2000", "RTN"]


def test_a_state_is_of_its_own_segment_and_may_have_accelerations():
    text = oem("1998-12-18T14:28:15")
    state = next(line for line in text.splitlines() if line.startswith("1998"))
    segment = text.split("\n", 1)[1].replace("EME2000", "ICRF")
    first, second = read_message(f"{text}\n{segment}".replace(state, f"{state} 0 0 0", 1).replace(f"\n{state}\n", "\n"))
    assert first.state.tolist() == list(STATE)
    assert (second.frame, second.state) == ("ICRF", None)


def test_units_and_epochs_that_a_message_writes_out_are_read():
    read = read_message(opm().replace("CX_X = ", "CX_X = 0").replace("\nCY_X", " [km ** 2]\nCY_X"))[0]
    assert np.array_equal(read.covariance, MATRIX)
    with pytest.raises(MessageFault, match=r"line 10: CX_X is in \[m\*\*2\]; the standard has it in \[km\*\*2\]"):
        read_message(opm().replace("\nCY_X", " [m**2]\nCY_X"))
    assert read_message(oem("1998-12-18T14:28:15.117200000"))[0].state is not None  # to the nanosecond


@pytest.mark.parametrize("place", [0, 1])
def test_a_covariance_of_fewer_or_more_than_six_rows_is_refused_with_its_line(place):
    text = oem("1998-12-18T14:28:15", "1998-12-18T15:28:15")
    last = f"{TRIANGLE.split(chr(10))[6]}\n"
    before, at, after = text.split(last)
    for instead, message in [("", "has 5 of its six rows"), (2 * last, "a seventh row")]:
        parts = (before, instead, at, last, after) if place == 0 else (before, last, at, instead, after)
        with pytest.raises(MessageFault, match=f"line {17 + 10 * place}: .*{message}"):
            read_message("".join(parts))
    with pytest.raises(MessageFault, match="has 1 of its six rows"):
        read_message(text.split(TRIANGLE)[0] + "1.0")  # which breaks off


def test_a_keyword_that_an_opm_has_twice_is_refused_and_those_of_manoeuvres_are_not():
    burn = "\nMAN_DURATION = 1\nCOMMENT a\nCOMMENT a"
    assert np.array_equal(read_message(opm() + burn + burn)[0].covariance, MATRIX)
    with pytest.raises(MessageFault, match="line 31: CX_X is there already, in line 10"):
        read_message(opm() + "\nCX_X = 1")


def test_a_mistake_in_the_campaign_file_is_named(folder):
    for before, after, message in [
        ('frame = "EME2000"', 'frame = "ITRF"', "axes ITRF cannot be had"),
        ('file = "state.opm"', 'file = "state.oem"', 'no file "state.oem"'),
        ('"dvz_m_s"]', "]", "at least 6 needed"),
        ('"dx_m"', '"dvx_m_s"', "has a dispersion already"),
        ('"dx_m"', '"dq_m"', "is not a parameter of drift"),
        ("frame", "fram", 'did you mean "frame"'),
        ("[covariance.launch]", "[covarianse.launch]", 'did you mean "covariance"'),
    ]:
        (folder / "campaign.toml").write_text(CAMPAIGN.replace(before, after))
        with pytest.raises(CampaignError, match=message):
            load_campaign(folder)


def only_problem(folder, text):
    """The place and the sentence of the one problem of a campaign file."""
    (folder / "campaign.toml").write_text(text)
    with pytest.raises(CampaignError) as error:
        load_campaign(folder)
    [problem] = error.value.problems
    return problem.place, problem.message


def test_an_epoch_that_is_none_is_named_where_it_is_written(folder):
    place, message = only_problem(folder, f'{CAMPAIGN}epoch = "tomorrow"\n')
    assert (place, message) == (
        "covariance.launch.epoch",
        '"tomorrow" is not an epoch such as 2026-01-31T12:00:00',
    )


@pytest.mark.parametrize("design", ["grid", "one_at_a_time", "table", "saltelli"])
def test_a_design_that_cannot_have_a_covariance_is_named_with_the_covariance(folder, design):
    (folder / "cases.csv").write_text("dx_m\n1.0\n")
    table = '\ntable = "cases.csv"' if design == "table" else ""
    cases = "cases = 24" if design == "saltelli" else ""
    text = CAMPAIGN.replace('"mc"', f'"{design}"{table}').replace("cases = 20", cases)
    place, message = only_problem(folder, text)
    assert place == "covariance.launch"
    assert message == f'the design "{design}" takes no covariance; covariances are for "mc", "lhs", "sobol"'


def test_a_covariance_without_correlations_goes_with_one_input_at_a_time(folder):
    apart = "\n".join(
        line
        if line.split(" = ")[0] not in {f"C{a}_{b}" for i, a in enumerate(AXES) for b in AXES[:i]}
        else f"{line.split(' = ')[0]} = 0.0"
        for line in opm().split("\n")
    )
    (folder / "state.opm").write_text(apart)
    (folder / "campaign.toml").write_text(CAMPAIGN.replace('"mc"', '"one_at_a_time"').replace("cases = 20", ""))
    assert load_campaign(folder).cases == 13


def test_a_message_that_cannot_be_used_is_refused_with_a_sentence(folder):
    for text, message in [
        ("", "no orbit message"),
        ("<xml>", "no orbit message"),
        (opm().replace("CZ_Z = ", "C_Z = "), "CZ_Z is missing"),
        (opm().replace("3.11548208", "fast"), '"fast" is not a finite number'),
        (opm().replace("CX_X = 0.00033", "CX_X = -0.00033"), "variance of X is not above 0"),
        (opm().replace(f"CX_X = {MATRIX[0, 0]}", "CX_X = 0"), "variance of X is not above 0"),
        (opm().replace("CY_X = 0.00046", "CY_X = 0.00056"), '"state.opm": the covariance is not positive definite'),
        (oem("1998-12-18T14:28:15", "1998-12-18T15:28:15"), "has 2 covariances"),
        (oem("yesterday"), '"yesterday" is not an epoch'),
        ("CCSDS_OEM_VERS = 3.0", "no covariance"),
    ]:
        (folder / "state.opm").write_text(text)
        with pytest.raises(CampaignError, match=message):
            load_campaign(folder)


def test_the_epoch_chooses_among_the_covariances_of_an_ephemeris(folder):
    (folder / "state.opm").write_text(oem("1998-12-18T14:28:15", "1998-12-18T15:28:15"))
    chosen = CAMPAIGN.replace('"EME2000"', '"RTN"\nepoch = "1998-352T15:28:15.0"')
    (folder / "campaign.toml").write_text(chosen)
    assert len(load_campaign(folder).dispersions) == 6
    (folder / "campaign.toml").write_text(chosen.replace("T15:28", "T16:28"))
    with pytest.raises(CampaignError, match="no covariance at 1998-352T16"):
        load_campaign(folder)


def test_two_covariances_at_the_epoch_asked_for_are_refused(folder):
    """The first one was taken, as of an ephemeris with a segment before and one after a manoeuvre."""
    (folder / "state.opm").write_text(oem("1998-12-18T15:28:15", "1998-12-18T15:28:15.0"))
    place, message = only_problem(folder, CAMPAIGN.replace('"EME2000"', '"RTN"\nepoch = "1998-12-18T15:28:15"'))
    assert (place, "has 2 covariances at 1998-12-18T15:28:15; leave only one" in message) == (
        "covariance.launch.file",
        True,
    )


@pytest.mark.parametrize("frame", ["ITRF-97", "ITRF2008", "GRC", "TDR"])
def test_local_axes_are_not_laid_along_a_velocity_relative_to_the_earth(frame):
    """They were turned by up to some degrees."""
    message = read_message(opm().replace("EME2000", frame))[0]
    assert np.array_equal(message.covariance_in(frame), MATRIX)
    with pytest.raises(MessageFault, match=f"RTN need an inertial velocity; that of the state is relative to {frame}"):
        message.covariance_in("RTN")
    with pytest.raises(MessageFault, match="TNW need an inertial velocity"):
        read_message(opm("TNW").replace("EME2000", frame))[0].covariance_in(frame)


def test_the_section_that_the_documentation_shows_disperses_a_shipped_campaign(tmp_path):
    page = Path(mc_engine.__file__).parent / "documentation" / "how_to" / "orbit_messages.md"
    section = page.read_text(encoding="utf-8").split("```text\n")[1].split("```")[0]
    (tmp_path / "state.opm").write_text(opm())
    head = '[campaign]\nmodel = "campaigns.geo_injection"\ncases = 10\ndesign = "mc"\nseed = 1\n'
    (tmp_path / "campaign.toml").write_text(head + section)
    campaign = load_campaign(tmp_path)
    turned = read_message(opm())[0].covariance_in("RTN") * IN_METRES**2
    assert np.allclose(campaign_covariance(campaign), turned, rtol=1e-12, atol=0.0)
    assert {one.source for one in campaign.dispersions} == {"orbit determination of the launch"}


def test_a_run_keeps_the_message_and_hands_its_end_states_on(folder):
    run = folder / "run"
    runner.run(load_campaign(folder), run, workers=1)
    for name in ("model.py", "campaign.toml", "state.opm"):
        (folder / name).unlink()  # the run directory stands alone
    assert runner.replay(run, 17).equal
    _check_oem(run)
    _check_csv(run)
    shutil.rmtree(run)


def _check_oem(run: Path):
    columns = ",".join(f"end_{name}" for name in NAMES)
    fails_with(2, call("export", run, "--format", "oem", "--columns", columns), "--frame is missing")
    options = ["--format", "oem", "--frame", "EME2000", "--epoch", "2026-01-31T23:59:55"]
    fails_with(2, call("export", run, *options), "the six of x, y, z")
    fails_with(2, call("export", run, *options, "--columns", f"{columns},end_x_m"), '"end_x_m" is there twice')
    swapped = ",".join(f"end_{name}" for name in (*NAMES[3:], *NAMES[:3]))
    fails_with(2, call("export", run, *options, "--columns", swapped), "an OEM needs length there")
    fails_with(2, call("export", run, *options[:-1], "noon", "--columns", columns), '"noon" is no date')
    done = call("export", run, *options, "--columns", columns)
    assert done.exit_code == 0, done.output
    assert "20 of 20 cases" in done.output
    points = [line.split() for line in (run / "end_states.oem").read_text().splitlines() if line.startswith("2026")]
    assert {point[0] for point in points} == {"2026-02-01T00:00:05"}
    table = open_store(run).cases([f"end_{name}" for name in NAMES]).to_numpy()
    assert np.allclose(np.array([point[1:] for point in points], dtype=float) * IN_METRES, table, rtol=1e-15)


def _check_csv(run: Path):
    for name in ("ends.parquet", "ends.oem"):
        fails_with(2, call("export", run, "--out", run.parent / name), "--format csv writes another kind of file; let")
    assert call("export", run).exit_code == 0
    rows = list(csv.DictReader((run / "end_states.csv").read_text().splitlines()))
    table = open_store(run).cases()
    assert list(rows[0]) == ["case_id", "status", "end_time_s", *(f"end_{name}" for name in NAMES)]
    assert [float(row["end_x_m"]) for row in rows] == list(table["end_x_m"])
    fails_with(2, call("export", run, "--columns", "end_x_n"), 'did you mean "end_x_m"')
    fails_with(2, call("export", run, "--format", "xml"), "csv or oem")
    for option, value in (("--epoch", "2026-01-31"), ("--frame", "EME2000"), ("--centre", "EARTH")):
        fails_with(2, call("export", run, option, value), f"{option} is for --format oem")
    fails_with(2, call("export", run, "--columns", ""), "--columns names no column")
    fails_with(2, call("export", run, "--columns", "end_x_m,end_y_m,end_x_m"), '"end_x_m" is there twice')
