"""The same motions, both computed at every step, and chosen by `where`."""

from two_motions import CHANGE, DECLARED, END, both, switch

from mc_engine.model import Event, model

SWITCH = {"change": Event(CHANGE.function, "rising", "switch"), **END}
MODEL = model(**DECLARED, rhs=both, events=SWITCH, switch=switch)
