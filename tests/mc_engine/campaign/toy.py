"""A small model for the tests of campaign files, and short ways to load them."""

from pathlib import Path

from mc_engine.campaign.loading import Campaign, load_campaign
from mc_engine.errors import CampaignError
from mc_engine.model import FixedStep, Parameter, Setting, inputs, metrics, model, outputs, states

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


def _nothing():
    raise AssertionError("no test of the inputs flies the model")


MODEL = model(
    name="toy",
    title="A stone with a thruster",
    source="nobody",
    inputs=inputs(
        speed_pct=Parameter(0.0, "Error of the speed", low=-100.0),
        angle_deg=Parameter(45.0, "Angle of throw", low=0.0, high=90.0),
        mass_kg=Parameter(100.0, "Mass", low=0.0),
        height_km=Parameter(10.0, "Height"),
        drag_area_m2=Parameter(1.0, "Drag area", low=0.0),
        delay_s=Parameter(0.0, "Delay of the throw", low=0.0),
        control=Setting("continuous", "How the thruster is driven", choices=("continuous", "clipped", "off")),
        drag=Setting(True, "Whether there is air"),
        step_s=Setting(0.5, "Step of integration", low=0.01, high=10.0),
    ),
    states=states(x_m="Distance"),
    outputs=outputs(range_m="Range so far"),
    metrics=metrics(range_m="Range", propellant_kg="Propellant used"),
    clock=FixedStep("step", 100.0),
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
