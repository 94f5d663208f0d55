"""Correct models that are written in unusual ways: neither `check` nor a flight may refuse them."""

import pytest
from mistaken_campaign import campaign_with, given, in_front, with_input

from mc_engine.flight.contract import breaches
from mc_engine.flight.contract_flight import faults

IMPORTS = "from mc_engine.lanes import"
RHS = "@physics\ndef rhs"
ACCELERATION = "    g = -MU_EARTH * rsqrt(r2) ** 3\n"
WHERE = ("sin, sqrt", "maximum, sin, sqrt, where")
SIGNATURE = ("def rhs(s)", "def rhs(t, s, m, p, o)")


def then(line):
    """An edit: one more line in `rhs`."""
    return (ACCELERATION, f"{ACCELERATION}    {line}\n")


def before(text):
    """An edit: more text before `rhs`."""
    return in_front(text, "rhs")


def with_metric(expression):
    """Edits: one metric more, of the time or the largest altitude."""
    return [
        WHERE,
        ("import Event", "import Event, Field"),
        ("Metrics = metrics(", 'Metrics = metrics(more=Field("what it came to", unit=""), '),
        in_front(f"@physics\ndef evaluate(t, best):\n    return Metrics(more={expression})"),
        given("evaluate=evaluate", 'extrema={"altitude": maximum_of("altitude_km", "")}'),
    ]


def with_setting(name):
    """Edits: one setting, which is zero."""
    return with_input(f'{name}=Setting(0.0, "a number", unit="")')


COMPOSED = """def composed(f, g):
    @physics
    def h(x):
        return f(g(x))

    return h


TWICE = composed(composed(sin, cos), sqrt)"""
GRAVITY = """class Gravity:
    MU, POWERS = 2.0, (1.0, 2.0)

    class Sun:
        FAR = True

    @staticmethod
    @physics
    def halved(x):
        return x / Gravity.MU"""
UNUSUAL = {
    "a function in the signature": [
        (IMPORTS, f"from collections.abc import Callable\n{IMPORTS}"),
        before("@physics\ndef applied(f: Callable[[float], float], x: float) -> float:\n    return f(x)"),
        then("g = g + 0.0 * applied(sin, s.x)"),
    ],
    "two functions of one factory": [before(COMPOSED), then("g = g + 0.0 * TWICE(r2)")],
    "an argument by its name": [
        before("@physics\ndef scaled(x, k=1.0):\n    return x * k"),
        then("g = g + scaled(s.x, k=0.0)"),
    ],
    "a division by the root of a setting that is zero": [
        *with_setting("drag"),
        WHERE,
        then("g = where(o.drag > 0.0, g / sqrt(o.drag), g)"),
    ],
    "a division by a number outside that is zero": [
        before("DRAG = 0.0"),
        WHERE,
        then("g = where(DRAG > 0.0, 1.0 / DRAG, g)"),
    ],
    "numpy on numbers that are written out": [
        (IMPORTS, f"import numpy as np\n\n{IMPORTS}"),
        then("g = g * np.sqrt(2.0) * np.sqrt(0.5)"),
    ],
    "a sum": [then("g = g + 0.0 * sum((s.x, s.y)) + 0.0 * divmod(7, 2)[0]")],
    "a counted while": [then("k = 0\n    while k < 3:\n        g = g + 0.0 * k\n        k += 1")],
    "a while that counts in other words": [
        before("STEP = 2"),
        then("n = 0\n    while n < 5:\n        n = n + 1\n    while 9 > n:\n        n += STEP\n    g = g + 0.0 * n"),
    ],
    "functions of its own by the names of NumPy's": [
        then(
            "def full(a):\n        return a * 2.0\n\n    stack = lambda a: a * 0.5\n    array = stack\n"
            "    g = array(full(stack(full(g))))"
        )
    ],
    "not on a mask": [WHERE, then("far = r2 > 1e14\n    g = where(not far, g, 0.0)")],
    "a text outside": [before('MODE = "fast"'), then('if MODE == "fast":\n        g = g + 0.0')],
    "a class for numbers and functions": [
        before(GRAVITY),
        then("g = Gravity.halved(g) * Gravity.POWERS[1] if Gravity.Sun.FAR else g"),
    ],
    "a namespace of numbers": [
        (IMPORTS, f"from types import SimpleNamespace\n\n{IMPORTS}"),
        before("EARTH = SimpleNamespace(scale=1.0)"),
        then("g = g * EARTH.scale"),
    ],
    "an argument that is left out": [
        before("@physics\ndef kept(x, k=None):\n    return x if k is None else x * k"),
        then("g = kept(g)"),
    ],
    "a try that never fails": [then("try:\n        g = g * 1.0\n    except Exception:\n        g = 0.0")],
    "a tuple cut and handed on": [then("x, y = s[:2]\n    g = g + 0.0 * State(*s).x + 0.0 * x * y")],
    "a flag that no case raises": with_metric("where(best.altitude > 2.0e6, 1.0, 0.0)"),
    "an excess that no case has": with_metric("maximum(0.0, t - 1.0e6)"),
    "an input that works evenly": [("dv * sin(p.pitch_error)", "0.0")],
}


@pytest.mark.parametrize("way", UNUSUAL)
def test_an_unusual_way_is_no_breach(way, tmp_path):
    assert breaches(campaign_with(tmp_path, SIGNATURE, *UNUSUAL[way])) == []


def test_the_unusual_ways_fly(tmp_path):
    edits = [edit for way, edits in UNUSUAL.items() if "excess" not in way for edit in edits]
    flag = edits.index(WHERE)
    assert (
        faults(campaign_with(tmp_path, SIGNATURE, *(e for i, e in enumerate(edits) if e != WHERE or i == flag))) == []
    )


# (lines in `rhs`, what stands before it)
LINES = [
    ("if MU_EARTH < 0.0:\n        raise ValueError", ""),
    ('assert MU_EARTH > 0.0, "positive"', ""),
    ("match LAW:\n        case 2:\n            g = g * 1.0\n        case _:\n            g = 0.0 * g", "LAW = 2"),
    ("g = (h := g) + 0.0 * h", ""),
    ("q: float = g * 1.0\n    a = b = q", ""),
    ("g = g + 0.0 * add(s.x, s.y)", "@physics\ndef add(*v):\n    return v[0] + v[1]"),
    ("f = lambda q: q * 1.0\n    g = f(g)", ""),
    ("for c in (1.0, 2.0):\n        g = g + 0.0 * c", ""),
    ("for c in s:\n        g = g + 0.0 * c", ""),
    ("for a, b in zip((1.0, 2.0), (s.x, s.y)):\n        g = g + 0.0 * a * b", ""),
    ("for k, b in enumerate((s.x, s.y)):\n        g = g + 0.0 * k * b", ""),
    ("for k in range(4):\n        if k % 2 == 0 or k // 2 == 1:\n            g = g + 0.0 * k\n            break", ""),
    ("g = g + 0.0 * s.x ** 2 + 0.0 * abs(s.y) + 0.0 * s[-1] * s[1:3][0]", ""),
    ("g = g + 0.0 * K[1] * K[-1] * len(K) * K.size * K.sum()", "K = np.ones(3)"),
    ("g = g + 0.0 * np.pi * np.deg2rad(2.0) * np.float64(3.0)", ""),
    ("g = g + 0.0 * K[1, 2]", "K = np.eye(3)"),
    ("g = g + 0.0 * K[1][0]", "K = ((1.0, 2.0), (3.0, 4.0))"),
    ("g = g + 0.0 * K[1](s.x)", "K = (sin, cos)"),
    ("g = g + 0.0 * LAWS.a(s.x)", 'LAWS = namedtuple("Laws", "a b")(sin, cos)'),
    ("lib = np\n    g = g + 0.0 * lib.pi", ""),
    ("g = g + 0.0 * two(s.x)", "@njit\ndef two(x):\n    return x * 2.0"),
    ("if MODE is Mode.A:\n        g = g * Mode.A.value", "class Mode(Enum):\n    A = 1.0\n\n\nMODE = Mode.A"),
    ("g = g + 0.0 * law(s.x, 'a')", "@physics\ndef law(x, kind):\n    return x if kind == 'a' else 2.0 * x"),
    ("g = g * Earth.mu", "@dataclass\nclass Earth:\n    mu: float = 1.0"),
    ("v = V(s.x, s.y)\n    g = g + 0.0 * v.x", "class V(NamedTuple):\n    x: float\n    y: float"),
    ("g = g + 0.0 * F(s.x)", "def made(k):\n    return physics(lambda x: k * x)\n\n\nF = made(2)"),
    ("f = sin if MU_EARTH > 0.0 else cos\n    g = g + 0.0 * f(s.x)", ""),
    ("if 0.0 < MU_EARTH < 1.0e20:\n        g = g * 1.0", ""),
    ("(a, b), c = (s.x, s.y), s.vx\n    a, b = b, a\n    g = g + 0.0 * a", ""),
    ("try:\n        g = g * 1.0\n    finally:\n        g = g + 0.0", ""),
    ("if not o.drag and o.drag < 1.0:\n        g = g * 1.0\n    for k in range(int(o.drag)):\n        g = g * 1.0", ""),
]  # fmt: skip
MODULES = """import numpy as np
from collections import namedtuple
from dataclasses import dataclass
from enum import Enum
from typing import NamedTuple
from numba import njit
"""


def test_an_unusual_line_is_no_breach(tmp_path):
    for number, (lines, text) in enumerate(LINES):
        imports = (IMPORTS, f"{MODULES}{IMPORTS}")
        edits = [imports, SIGNATURE, before(text), *with_setting("drag"), then(lines)]
        assert breaches(campaign_with(tmp_path / str(number), *edits)) == [], lines
