"""A small model to hold campaign files against, and short ways to load them."""

from collections import namedtuple
from pathlib import Path

from mc_engine.campaign.loading import Campaign, load_campaign
from mc_engine.errors import CampaignError
from mc_engine.model import Field, FixedStep, Model, Parameter, Setting

HERE = Path(__file__).resolve().parent

HEAD = """
[campaign]
model = "toy.py"
design = "{design}"
seed = {seed}
"""


def _prepare(inputs, settings, refusals):
    refusals.add(inputs.drag_area > 50.0, "the drag area is larger than the sky")
    return vars(inputs)


def _nothing(*_):
    raise AssertionError("no test of the inputs flies the model")


MODEL = Model(
    name="toy",
    title="A stone with a thruster",
    source="nobody",
    parameters=(
        Parameter("speed_pct", "%", "Error of the speed", 0.0, low=-100.0),
        Parameter("angle_deg", "deg", "Angle of throw", 45.0, low=0.0, high=90.0),
        Parameter("mass_kg", "kg", "Mass", 100.0, low=0.0),
        Parameter("height_km", "km", "Height", 10.0),
        Parameter("drag_area_m2", "m^2", "Drag area", 1.0, low=0.0),
        Parameter("delay_s", "s", "Delay of the throw", 0.0, low=0.0),
    ),
    settings=(
        Setting("control", "", "How the thruster is driven", "continuous", ("continuous", "clipped", "off")),
        Setting("drag", "", "Whether there is air", True),
        Setting("step_s", "s", "Step of integration", 0.5, low=0.01, high=10.0),
    ),
    states=(Field("x_m", "m", "Distance"),),
    quantities=(Field("range_m", "m", "Range so far"),),
    metrics=(Field("range_m", "m", "Range"), Field("propellant_kg", "kg", "Propellant used")),
    clock=FixedStep("step", 100.0),
    kernel_parameters=namedtuple("P", "speed angle mass height drag_area delay"),
    initial=_nothing,
    rhs=_nothing,
    observe=_nothing,
    evaluate=_nothing,
    prepare=_prepare,
)


def load(body: str, design: str = "mc", seed: int = 1, directory: Path = HERE, head: str = HEAD, **options) -> Campaign:
    """The campaign of the toy model with this body; 100 cases where the design needs a number."""
    text = head.format(design=design, seed=seed)
    if design in ("mc", "lhs", "sobol") and "cases" not in text + body.split("[")[0]:
        text += "cases = 100\n"
    return load_campaign("toy.toml", text=text + body, directory=directory, **options)


def problems(body: str, design: str = "mc", **options) -> dict[str, str]:
    """Place -> message of all that is wrong with the campaign; empty if nothing is."""
    try:
        load(body, design, **options)
    except CampaignError as error:
        return {problem.place: problem.message for problem in error.problems}
    return {}
