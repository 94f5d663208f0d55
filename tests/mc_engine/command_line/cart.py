"""A campaign of a cart, and the command line called inside a test."""

from typer.testing import CliRunner

from mc_engine.command_line.commands import app
from mc_engine.store.store import create_store
from tests.mc_engine.store.small_run import COLUMNS, MANIFEST, TEXT, filled

MODEL = """
from mc_engine.model import FixedStep, Parameter, Setting, inputs, metrics, model, outputs, states

MODEL = model(
    name="cart", title="A cart",
    inputs=inputs(push_n=Parameter(2.0, "push", 0.0, 9.0), track=Setting("ice", "surface", choices=("ice", "sand"))),
    states=states(x_m="place"), outputs=outputs(x_m="place"), metrics=metrics(range_m="how far it came"),
    clock=FixedStep(0.1, 1.0),
    initial=lambda: None, rhs=lambda: None, observe=lambda: None, evaluate=lambda: None,
)
"""
CAMPAIGN = """
[campaign]
model = "model.py"
cases = 20
design = "mc"
seed = 7

[dispersion.push_n]
dist = "uniform"
lower = 1.0
upper = 3.0

[requirement.reach]
metric = "range_m"
at_least = 1.0
"""


def call(*arguments):
    return CliRunner().invoke(app, [str(argument) for argument in arguments])


def fails_with(status, result, *words):
    """The verb ended with `status` and a sentence on stderr with `words`, and without a traceback."""
    assert result.exit_code == status, result.output
    assert not isinstance(result.exception, Exception) or isinstance(result.exception, SystemExit)
    assert "Traceback" not in result.output
    text = " ".join(result.stderr.split())
    for word in words:
        assert word in text


REQUIREMENT = {"metric": "propellant_kg", "at_most": None, "at_least": None, "share": 0.5, "confidence": 0.9}


def small_store(path, cases=40, fly=True, design="mc"):
    """A run as the runner leaves it; the requirement "fuel" passes, "zero" does not."""
    requirements = [
        {**REQUIREMENT, "name": "fuel", "at_most": 100.0},
        {**REQUIREMENT, "name": "zero", "at_most": -100.0},
    ]
    campaign = {"name": "test", "cases": cases, "design": design}
    store = create_store(path, {**MANIFEST, "campaign": campaign, "requirements": requirements}, TEXT, COLUMNS)
    return filled(store) if fly else store
