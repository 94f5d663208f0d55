"""Habits of Python and NumPy that physics has not: each is answered with what the user wrote, and the fix."""

import pytest
from mistaken_campaign import campaign_with, line_of

from mc_engine.errors import CampaignError, ModelError
from mc_engine.lanes import any_lane, where
from mc_engine.model_contract import breaches

ACCELERATION = "    g = -MU_EARTH / (r2 * sqrt(r2))\n"
RHS = "@physics\ndef rhs"
IMPORTS = "from mc_engine.lanes import"
WHERE = ("sin, sqrt", "any_lane, sin, sqrt, where")


def then(line):
    """An edit: one more line in `rhs`."""
    return (ACCELERATION, f"{ACCELERATION}    {line}\n")


# name: (edits, text on the line that is named, sentence)
HABITS = {
    "a generator": (
        [("s.x * s.x + s.y * s.y\n    g", "sum(c * c for c in (s.x, s.y))\n    g")],
        "    r2 = sum(",
        "`(c * c for c in (s.x, s.y))` in `rhs` is a generator, which kernels cannot run; write its terms out",
    ),
    "the rest of a tuple": (
        [then("x, *v = s")],
        "    x, *v",
        "`*v` in `rhs` takes the rest of a tuple; name each part, or cut it out, as s[2:]",
    ),
    "an error that is caught": (
        [then("try:\n        g = g * 1.0\n    except ZeroDivisionError:\n        g = 0.0")],
        "    try:",
        "`try` in `rhs`: physics raises nothing, it goes on with an infinity or with what is not a number; keep",
    ),
    "with": (
        [(IMPORTS, f"from threading import Lock\n{IMPORTS}"), (RHS, f"LOCK = Lock()\n\n\n{RHS}"),
         then("with LOCK:\n        g = g * 1.0")],
        "    with LOCK",
        "`with LOCK` in `rhs` is not for physics, which only computes; leave it out",
    ),
    "yield": ([then("yield g")], "    yield g", "`(yield g)` in `rhs`: physics gives its result once, and at its end"),
    "async in a helper": (
        [(RHS, f"@physics\nasync def kept(x):\n    return x\n\n\n{RHS}"), then("a = kept(g)")],
        "@physics\nasync def kept",
        "`kept` is an async def; write def, physics waits for nothing",
    ),
    "an argument behind a star": (
        [(RHS, f"@physics\ndef kept(x, *, gain=1.0):\n    return x * gain\n\n\n{RHS}"), then("a = kept(g)")],
        "@physics\ndef kept",
        "`kept` has `gain` behind a `*`, and kernels hand arguments over by their places; leave the star out",
    ),
    "a field that is left to its default": (
        [(RHS, f'Pair = namedtuple("Pair", "a b", defaults=(1.0,))\n\n\n{RHS}'), then("a = Pair(g)")],
        "    a = Pair(g)",
        "`Pair(g)` in `rhs` leaves a field to its default; write every field",
    ),
    "is False": (
        [WHERE, then("g = where((s.x > 0.0) is False, g, g)")],
        "    g = where",
        "`(s.x > 0.0) is False` in `rhs` compares objects, not values; a condition stands alone, or behind `not`",
    ),
    "a field that is set": (
        [then("s.x += 1.0")],
        "    s.x += 1.0",
        "`s.x` is set in `rhs`, where records are only read; make another, State(...) with every field",
    ),
    "a number as a condition": (
        [WHERE, then("g = where(s.x, g, 2.0 * g)")],
        "    g = where",
        "`where` wants a condition first, and this is none; compare the number, such as s.x > 0.5",
    ),
    "a number for any_lane": (
        [WHERE, then("g = g * 1.0 if any_lane(s.x) else g")],
        "    g = g * 1.0",
        "`any_lane` wants a condition first, and this is none; compare the number, such as s.x > 0.5",
    ),
    "a choice of conditions": (
        [WHERE, then("far = where(s.x > 0.0, s.y > 0.0, s.y < 0.0)")],
        "    far = where",
        "`where` chooses between numbers; between conditions, write (mask & x) | ((not mask) & y)",
    ),
    "a choice of tuples": (
        [WHERE, then("far = where(s.x > 0.0, (s.x, s.y), (s.y, s.x))")],
        "    far = where",
        "`where` takes (mask, x, y), each one number or condition",
    ),
    "min over several lines": (
        [then("g = g + 0.0 * min(\n        s.x,\n        s.y,\n    )")],
        "    g = g + 0.0 * min(",
        "`min(s.x, s.y)`: `min` on a number that differs from case to case; use minimum(a, b) of mc_engine.lanes",
    ),
    "assert": (
        [then("assert s.x > 0.0")],
        "    assert",
        "`assert s.x > 0.0` on a number that differs from case to case; a case that is not to be flown is refused in",
    ),
    "in": ([then("g = g if s.x in (0.0, 1.0) else 0.0")], "    g = g if", "write (x == a) | (x == b)"),
    "round": ([then("g = round(g)")], "    g = round", "`round` on a number that differs from case to case; use rint("),
    "a place in an array": (
        [(IMPORTS, f"import numpy as np\n\n{IMPORTS}"), (RHS, f"T = np.ones(3)\n\n\n{RHS}"), then("g = g * T[s.x]")],
        "    g = g * T",
        "`T[s.x]` has its place from a number that differs from case to case; numbers to look up go into `tables`, and "
        "are read with look_up(o.tables, place)",
    ),
    "a place in a tuple": ([(RHS, f"T = (1.0, 2.0)\n\n\n{RHS}"), then("g = T[s.x > 0.0]")], "    g = T",
                           "`T[s.x > 0.0]` has its place from a number that differs from case to case"),
    "noise outside of control": (
        [(IMPORTS, f"from mc_engine.lanes.noise import normal_pair\n{IMPORTS}"), then("n, _ = normal_pair(t, 0)")],
        "    n, _ =",
        "`normal_pair` takes (draws, index); `draws` is an argument of `control`, and noise is drawn there alone",
    ),
    "a product of matrices": ([then("g = s.x @ s.y")], "    g = s.x @", "`s.x @ s.y` cannot be computed; write the"),
    "a number among conditions": (
        [then("far = (s.x > 0.0) & s.y")],
        "    far = ",
        "`(s.x > 0.0) & s.y` cannot be computed; both sides are conditions, such as (x > 0.0) & (y > 0.0)",
    ),
    "a scaled record": ([then("a = 2.0 * s")], "    a = 2.0", "`2.0 * s` cannot be computed; physics computes with"),
    "a method of numbers": ([then("g = g.norm()")], "    g = g.norm", "a number has no `norm`; physics uses the"),
    "a number that is called": ([then("g = s.x(2.0)")], "    g = s.x(", "TypeError: a number is not callable"),
    "a list in a class": (
        [(RHS, f"class Earth:\n    mu = [1.0]\n\n\n{RHS}"), then("g = g * Earth.mu[0]")],
        "    g = g * Earth",
        "`Earth.mu` in `rhs` is a list outside of it; physics reads numbers and tuples",
    ),
    "a function of a class that is not marked": (
        [(RHS, f"class Earth:\n    @staticmethod\n    def pull(x):\n        return x\n\n\n{RHS}"),
         then("g = Earth.pull(g)")],
        "    @staticmethod",
        "`pull` is not marked, and `rhs` calls it; write @physics on the line above",
    ),
}  # fmt: skip


@pytest.mark.parametrize("habit", HABITS)
def test_a_habit_of_python_has_its_sentence(habit, tmp_path):
    edits, spot, sentence = HABITS[habit]
    (found,) = breaches(campaign_with(tmp_path / "model", *edits))
    assert found.startswith(f"model.py, line {line_of(tmp_path / 'model', spot)}: ")
    assert sentence in found
    assert not any(word in found for word in ("ndarray", str(tmp_path), "\n"))


def test_an_import_from_a_dot_is_named_at_its_line(tmp_path):
    with pytest.raises(CampaignError) as error:
        campaign_with(tmp_path, (IMPORTS, f"from .guidance import k\n{IMPORTS}"))
    (problem,) = error.value.problems
    assert problem.message.startswith(f"model.py, line {line_of(tmp_path, 'from .guidance')}: an import from a dot")


@pytest.mark.parametrize("arguments", [(1.0, 2.0, 3.0), (True, False, 3.0), (True, 2.0, True)])
def test_where_chooses_by_a_condition_between_numbers(arguments):
    assert where(True, 2.0, 3.0) == 2.0
    with pytest.raises(ModelError, match="`where`"):
        where(*arguments)
    with pytest.raises(ModelError, match="`any_lane`"):
        any_lane(1.0)
