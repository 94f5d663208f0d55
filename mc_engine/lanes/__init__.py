"""The lane engine: physics written once on plain numbers, compiled for one case and for vectors of cases."""

from mc_engine.lanes.elementary import acos, asin, atan, atan2, cos, exp, log, pow, rsqrt, sin, sincos, tan
from mc_engine.lanes.functions import (
    any_lane,
    copysign,
    floor,
    fma,
    look_up,
    look_up_record,
    maximum,
    merged,
    minimum,
    replace,
    rint,
    sqrt,
    where,
)
from mc_engine.lanes.physics_function import physics

__all__ = [
    "acos",
    "any_lane",
    "asin",
    "atan",
    "atan2",
    "copysign",
    "cos",
    "exp",
    "floor",
    "fma",
    "log",
    "look_up",
    "look_up_record",
    "maximum",
    "merged",
    "minimum",
    "physics",
    "pow",
    "replace",
    "rint",
    "rsqrt",
    "sin",
    "sincos",
    "sqrt",
    "tan",
    "where",
]
