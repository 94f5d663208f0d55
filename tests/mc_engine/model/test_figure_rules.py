"""Figures of a model: their names and the kinds of their fields are looked at where the model is made."""

from mistaken_campaign import campaign_with, given, refused

KINDS = "CorridorFigure, FootprintFigure, HistoryFigure, MapFigure, ProfileFigure, ScatterFigure"
MAP = 'MapFigure("apogee_altitude_km", "pitch_error_deg", "magnitude_error_pct", "t")'


def with_figures(figures):
    """The edits that give the smallest model these figures."""
    lines = f"from mc_engine.model.figures import {KINDS}\n"
    return ("from mc_engine.lanes import", f"{lines}from mc_engine.lanes import"), given(f"figures={figures}")


def test_figures_of_what_the_model_has_are_taken(tmp_path):
    for figure in [
        MAP,
        'MapFigure("end_x_m", "pitch_error_deg", "burn_dv_m_s", "t")',
        'MapFigure("apogee_time_s", "ve_pct", "oe_pct", "t", upstream=True)',
        'HistoryFigure(("altitude_km", "speed_m_s"), "t")',
        'ScatterFigure("end_time_s", "top_speed_m_s", "t")',
        'ProfileFigure("t_s", "altitude_km", "t")',
        'CorridorFigure("pitch_error_deg", "end_vx_m_s", ("top_speed_m_s",), "t")',
        'FootprintFigure("end_x_m", "end_y_m", "t", ends_below=("end_vx_m_s", 3), target=("end_x_m", "altitude_km"))',
    ]:
        assert len(campaign_with(tmp_path, *with_figures(f"({figure},)")).model.figures) == 1


MISTAKES = {
    "no figure": ("(1,)", "the model has (1,) as its `figures`; it must be a tuple, each item MapFigure or HistoryF"),
    "one alone": (MAP, "as its `figures`; it must be a tuple, each item MapFigure or HistoryFigure or"),
    "a metric": (MAP.replace("apogee_altitude", "apogee"),
                 'the MapFigure "t": there is no column "apogee_km"; did you mean "apogee_altitude_km"?'),
    "an input": (MAP.replace("pitch_error_deg", "pitch_error"), 'no column "pitch_error"; did you mean "pitch_error_d'),
    "a metric of a map over the columns of another run": (
        MAP.replace("apogee_altitude", "apogee").replace('"t")', '"t", upstream=True)'), 'no column "apogee_km"; did'),
    "a text in place of a tuple": ('HistoryFigure("altitude_km", "t")', "has 'altitude_km' as its `quantities`; it "
                                   "must be a tuple, each item a text; one alone needs its comma, (...,)"),
    "a list in place of a tuple": ('HistoryFigure(["altitude_km"], "t")', "it must be a tuple, each item a text; one"),
    "nothing to draw": ('HistoryFigure((), "t")', "has () as its `quantities`; it must name one at least"),
    "an output": ('HistoryFigure(("altitude_km", "spedd_m_s"), "t")', 'no output "spedd_m_s"; did you mean "spe'),
    "a metric in time": ('HistoryFigure(("top_speed_m_s",), "t")', 'there is no output "top_speed_m_s" (it is a '
                         'column of the table of cases, histories do not have it); did you mean "speed_m_s"?'),
    "an output as a column": ('ScatterFigure("speed_m_s", "apogee_time_s", "t")', 'no column "speed_m_s" (it is an '
                               "output of histories, the table of cases does not have it)"),
    "a profile": ('ProfileFigure("speed", "altitude_km", "t")', 'no output "speed"; did you mean "speed_m_s"?'),
    "a number as a name": ('ScatterFigure(1, "apogee_time_s", "t")', "has 1 as its `x`; it must be a text"),
    "a number as a title": ('ScatterFigure("end_x_m", "end_y_m", 3)', "has 3 as its `title`; it must be a text"),
    "a word where yes or no is wanted": (MAP.replace('"t")', '"t", upstream="deorbit")'), "it must be True or False"),
    "a corridor": ('CorridorFigure("end_x_m", "end_y_m", ("end_x_m",), "t")', 'no metric "end_x_m"; known are "apog'),
    "a height": ('FootprintFigure("end_x_m", "end_y_m", "t", ends_below=("end_vx_m_s",))', "a tuple of a text"),
    "a target": ('FootprintFigure("end_x_m", "end_y_m", "t", target="here")', "has 'here' as its `target`; it must"),
    "a planet": ('FootprintFigure("end_x_m", "end_y_m", "t", planet="mars")', 'there is no setting "mars"'),
    "a latitude": ('FootprintFigure("latitude_deg", "end_y_m", "t")', 'there is no column "latitude_deg"'),
}  # fmt: skip


def test_a_figure_of_what_the_model_does_not_have_is_refused(tmp_path):
    for mistake, (figures, sentence) in MISTAKES.items():
        alone, folder = mistake in ("no figure", "one alone"), tmp_path / mistake
        refused(folder, with_figures(figures if alone else f"({figures},)"), sentence, "MODEL = model(")
