"""Physics that Python runs and no kernel can: told in the user's words, at his line, never in the compiler's."""

import re

import pytest
from mistaken_campaign import campaign_with, line_of

from mc_engine.contract_flight import faults
from mc_engine.errors import ModelError
from mc_engine.model_contract import breaches
from mc_engine.runner import run

ACCELERATION = "    g = -MU_EARTH / (r2 * sqrt(r2))\n"
RHS = "@physics\ndef rhs"
IMPORTS = "from mc_engine.lanes import"
ARRAY = [(IMPORTS, f"import numpy as np\n\n{IMPORTS}"), (RHS, f"K = np.ones(2)\n\n\n{RHS}")]
INSTANCE = "@dataclass(frozen=True)\nclass Planet:\n    mu: float\n\n\nEARTH = Planet(1.0)"
# the compiler's own: its types, its files, its addresses
THEIRS = re.compile(r"Function\(|lanes_|0x[0-9a-f]{6}|nopython|opcode|site-packages|/|float64|signature|Literal")

# name: (edits, the line in `rhs` that is named, sentence)
BEYOND = {
    "arithmetic of arrays": (ARRAY, "g = g * (K * 2.0)[0]", "an array, a list or a text is made in physics"),
    "a method of arrays": ([], "g = g.sum()", "a number has no `sum`; physics uses the functions of mc_engine.lanes"),
    "a condition that is compared": (
        [],
        "far = (s.x > 0.0) == (s.y > 0.0)",
        "`==` is given a condition and a condition; a condition stands alone, or behind `not`",
    ),
    "a complex number": ([], "g = (g + 0j).real", "`+` is given a number and a complex number; physics has no complex"),
    "a sum of records": ([], "a = s + s", "`+` is given a record and a record; take its fields"),
    "a root of a condition": ([], "g = g * sqrt(s.x > 0.0)", "`sqrt` takes (x), by their places; here it is"),
    "an argument by its name": ([], "g = g * sqrt(x=1.0 + r2)", "here it is given a number by the name `x`"),
    "what nothing is known of": ([], "del r2", "`del r2` is more than kernels can run; write it with numbers, named"),
    "an object of a class": (
        [(RHS, f"class Foo:\n    def __init__(self, x):\n        self.x = x\n\n\n{RHS}")],
        "g = Foo(g).x",
        "`Foo` is a class, and physics makes no objects but named tuples; make it a namedtuple",
    ),
    "an object outside": (
        [(IMPORTS, f"from dataclasses import dataclass\n\n{IMPORTS}"), (RHS, f"{INSTANCE}\n\n\n{RHS}")],
        "g = g * EARTH.mu",
        "`EARTH` is nothing that physics can read; it reads numbers, tuples and marked functions: put its numbers in a",
    ),
}  # fmt: skip


@pytest.mark.parametrize("way", BEYOND)
def test_what_kernels_cannot_run_is_told_in_the_users_words(way, tmp_path):
    edits, line, sentence = BEYOND[way]
    campaign = campaign_with(tmp_path / "model", *edits, (ACCELERATION, f"{ACCELERATION}    {line}\n"))
    assert breaches(campaign) == []
    (found,) = faults(campaign)
    assert found.startswith(f"model.py, line {line_of(tmp_path / 'model', f'    {line}')}: ")
    assert sentence in found
    assert not THEIRS.search(found.replace(line, ""))
    with pytest.raises(ModelError) as refused:
        run(campaign, tmp_path / "run")
    assert found in str(refused.value)
