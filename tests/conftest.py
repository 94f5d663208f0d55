"""Settings for all tests: which of them are deep, the same examples on every machine, and no clock on a single one.

At the end of every run, also of `pytest -q`, stands what the tests of faults have counted and measured: a test says it
with `record_property(what, number)`, and the processes of `-n` hand it on with their reports.
"""

import os
import sys

import pytest
from hypothesis import settings

# The processes of `-n` share the cores; of the threads that linear algebra starts in each, most wait for the others.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
# Tests start hundreds of processes; without kept bytecode each of them would compile the sources of all libraries.
os.environ.pop("PYTHONDONTWRITEBYTECODE", None)
sys.dont_write_bytecode = False

settings.register_profile("repeatable", derandomize=True, deadline=None)
settings.load_profile("repeatable")

TESTS = "tests/"
FAULTS = TESTS + "faults/"

# Tests that take long and that a first change of the code seldom breaks, by how their names begin.  `pytest` leaves
# them out, as it does all tests marked `benchmark`; `pytest -m deep` runs them, and so does continuous integration.
DEEP = (
    "benchmarks/",
    "campaigns/deorbit/test_deorbit_modulator.py::test_flown",
    "campaigns/deorbit/test_deorbit_twin.py",
    "campaigns/flexible_satellite/test_flexible_inputs.py",
    "campaigns/flexible_satellite/test_flexible_modulator.py::test_a_late_valve",
    "campaigns/flexible_satellite/test_flexible_modulator.py::test_a_torque",
    "campaigns/flexible_satellite/test_flexible_modulator.py::test_cases_with_many_pulses",
    "campaigns/flexible_satellite/test_flexible_monte_carlo.py",
    "campaigns/flexible_satellite/test_flexible_tuning.py",
    "campaigns/flexible_satellite/test_flexible_twin.py",
    "campaigns/geo_injection/",
    "campaigns/geo_servicing/",
    "campaigns/reentry/",
    "campaigns/test_published_values.py::test_recomputed_values",
    "documentation/test_calisto.py",
    "documentation/test_examples.py",
    "documentation/test_pages.py::test_recipes_run_from_top_to_bottom_and_their_campaigns_load[how_to/notebook",
    "documentation/test_pages.py::test_the_prepared_campaign",
    "documentation/test_pages.py::test_the_rocket",
    "documentation/test_recipes_over_a_store.py",
    "documentation/test_simulator_examples.py",
    "documentation/test_site.py",
    "documentation/test_tutorial.py",
    "faults/",
    "mc_engine/campaign/test_chain.py",
    "mc_engine/campaign/test_covariances.py::test_a_run_keeps",
    "mc_engine/command_line/test_cli_next_commands.py::test_the_command_that_flies",
    "mc_engine/command_line/test_debug.py",
    "mc_engine/command_line/test_lazy_imports.py::test_a_run_its_status",
    "mc_engine/command_line/test_lazy_imports.py::test_check_and_status",
    "mc_engine/command_line/test_shell.py::test_a_standard_error",
    "mc_engine/command_line/test_shell.py::test_streams",
    "mc_engine/command_line/test_trust.py::test_commands_that_run_no_code",
    "mc_engine/command_line/test_watching.py::test_every",
    "mc_engine/flight/cards/test_card_code.py::test_cards_round",
    "mc_engine/flight/cards/test_card_code.py::test_on_the_processor",
    "mc_engine/flight/cards/test_card_code.py::test_the_code_assembles",
    "mc_engine/flight/cards/test_card_code.py::test_the_code_is_the_same",
    "mc_engine/flight/cards/test_card_flights.py::test_a_run_on_cards",
    "mc_engine/flight/cards/test_card_flights.py::test_the_stand_in",
    "mc_engine/flight/cards/test_card_flights.py::test_what_a_card_cannot",
    "mc_engine/flight/test_five_kinds.py",
    "mc_engine/flight/test_fmus.py",
    "mc_engine/flight/test_kernel.py",
    "mc_engine/flight/test_kernel_key.py",
    "mc_engine/flight/test_lost_numbers.py",
    "mc_engine/flight/test_model_contract.py",
    "mc_engine/flight/test_simulator_peers.py",
    "mc_engine/flight/test_simulator_studies.py",
    "mc_engine/flight/test_simulators.py",
    "mc_engine/lanes/test_adaptive_flight.py::test_a_falling_crossing",
    "mc_engine/lanes/test_adaptive_flight.py::test_a_history",
    "mc_engine/lanes/test_adaptive_flight.py::test_apogee",
    "mc_engine/lanes/test_adaptive_flight.py::test_energy",
    "mc_engine/lanes/test_adaptive_flight.py::test_every_crossing",
    "mc_engine/lanes/test_adaptive_flight.py::test_every_width",
    "mc_engine/lanes/test_adaptive_flight.py::test_neither_order",
    "mc_engine/lanes/test_adaptive_flight.py::test_the_error_falls",
    "mc_engine/lanes/test_adaptive_flight.py::test_the_time_of_a_largest_value",
    "mc_engine/lanes/test_events.py::test_cases_with_events",
    "mc_engine/lanes/test_extrema.py::test_an_extreme_never_goes",
    "mc_engine/lanes/test_gauss_jackson.py",
    "mc_engine/lanes/test_history.py",
    "mc_engine/lanes/test_missing_numbers.py::test_a_case_is_not_finite",
    "mc_engine/lanes/test_multistep.py",
    "mc_engine/lanes/test_multistep_flights.py",
    "mc_engine/lanes/test_phases.py::test_a_delay",
    "mc_engine/lanes/test_phases.py::test_an_action",
    "mc_engine/lanes/test_phases.py::test_an_event_that_never",
    "mc_engine/lanes/test_phases.py::test_bytes_depend_on_no_width_chunk_thread_or_order[",
    "mc_engine/lanes/test_phases.py::test_the_interpreted",
    "mc_engine/lanes/test_phases.py::test_what_the_phase",
    "mc_engine/lanes/test_plain_numbers.py",
    "mc_engine/lanes/test_record_tables.py::test_a_case_has",
    "mc_engine/lanes/test_records.py::test_a_discrete",
    "mc_engine/lanes/test_tables.py::test_a_place_outside",
    "mc_engine/lanes/test_tables.py::test_every_lane",
    "mc_engine/model/test_compiled_loops.py::test_a_loop_is_compiled_once",
    "mc_engine/model/test_declarations.py::test_a_discrete_state",
    "mc_engine/model/test_declarations.py::test_arguments",
    "mc_engine/model/test_declarations.py::test_choices",
    "mc_engine/model/test_declarations.py::test_events_may_share",
    "mc_engine/model/test_declarations.py::test_physics_reads",
    "mc_engine/model/test_files_beside.py",
    "mc_engine/model/test_model_mistakes.py::test_a_line_that_is",
    "mc_engine/model/test_model_mistakes.py::test_no_kernel_is_built_for_other_counts_than_the_model_declares[adaptive",
    "mc_engine/model/test_model_mistakes.py::test_what_only_the_compiler",
    "mc_engine/model/test_phase_declarations.py::test_an_event_of_a_phase",
    "mc_engine/model/test_phase_declarations.py::test_an_event_of_the_second_phase",
    "mc_engine/model/test_phase_declarations.py::test_check_has_nothing",
    "mc_engine/model/test_unusual_models.py::test_the_unusual_ways_fly",
    "mc_engine/physics/test_curves.py::test_a_cubic_surface",
    "mc_engine/physics/test_curves.py::test_a_surface",
    "mc_engine/physics/test_curves.py::test_what_is_not_a_number",
    "mc_engine/physics/test_curves_in_models.py",
    "mc_engine/physics/test_earth_frames.py::test_courses",
    "mc_engine/physics/test_earth_frames.py::test_matrices",
    "mc_engine/physics/test_earth_frames.py::test_orbital_axes",
    "mc_engine/physics/test_earth_frames.py::test_rates",
    "mc_engine/physics/test_earth_frames.py::test_relative_states",
    "mc_engine/physics/test_rigid_body.py::test_the_derivatives",
    "mc_engine/physics/test_rotations.py::test_a_matrix",
    "mc_engine/physics/test_rotations.py::test_components",
    "mc_engine/physics/test_rotations.py::test_euler_angles",
    "mc_engine/physics/test_rotations.py::test_frames",
    "mc_engine/physics/test_rotations.py::test_the_derivative",
    "mc_engine/physics/test_rotations.py::test_the_shortest_turn",
    "mc_engine/runner/test_contributions.py",
    "mc_engine/runner/test_runner.py::test_an_interrupted",
    "mc_engine/statistics/test_change_tests.py",
    "mc_engine/statistics/test_coverage.py",
    "mc_engine/statistics/test_maps.py::test_two_errors",
    "mc_engine/statistics/test_rare_events.py",
    "mc_engine/statistics/test_sensitivity.py::test_the_standard_errors",
    "mc_engine/statistics/test_time_uniform.py::test_whoever_looks",
    "mc_engine/statistics/test_total_order.py::test_an_input_without_effect",
    "mc_engine/statistics/test_total_order.py::test_the_standard_errors",
    "mc_engine/studies/test_bench.py::test_bench_prints",
    "mc_engine/studies/test_bench.py::test_methods_are",
    "mc_engine/studies/test_bench.py::test_the_timed",
    "mc_engine/studies/test_opened_run.py::test_a_trace_names",
    "mc_engine/studies/test_rare_event.py",
    "mc_engine/studies/test_tuning.py::test_a_killed",
    "mc_engine/test_interruption.py",
    "reports/contributors/test_sensitivity_section.py::test_few",
    "reports/footprint/test_footprints.py::test_what_cannot_be_drawn",
    "reports/formats/test_html.py::test_a_page_holds_all",
    "reports/formats/test_html.py::test_a_page_that_cannot",
    "reports/formats/test_html.py::test_the_page_of_ten_thousand",
    "reports/formats/test_html.py::test_what_users_write",
    "reports/formats/test_markdown.py::test_what_users_write",
    "reports/formats/test_pdf.py::test_payloads",
    "reports/formats/test_pdf.py::test_the_same_run",
    "reports/formats/test_pdf.py::test_two_readers",
    "reports/run/test_streamed_cases.py",
    "reports/sections/test_corridors.py::test_few",
    "reports/test_browser.py",
    "reports/test_clean_text.py::test_the_pdf",
    "reports/test_counts_agree.py",
    "reports/test_reports_cli.py::test_a_table_of_25",
    "reports/user_sections/test_template_bounds.py",
    "reports/user_sections/test_user_sections.py::test_values_of_a_run",
)
# Models that fly with either integrator are flown on the fixed grid; with these parameters their tests are deep, too.
DEEP_PARAMETERS = ("[AdaptiveStep", "[phased_rocket_adaptive")
# Of these, the ones that are always run: a few flights of de-orbit and flexible satellite, faults of some kinds, the
# smallest models.
NOT_DEEP = (
    "campaigns/deorbit/test_deorbit_twin.py::test_the_published_case",
    "campaigns/flexible_satellite/test_flexible_twin.py::test_a_case_has",
    "campaigns/test_published_values.py::test_recomputed_values_are_the_kept_ones_to_the_digits_that_are_shown[deorbit",
    "documentation/test_calisto.py::test_its_200_kept_cases",
    "faults/test_damage.py::test_verify_names_every_file",
    "faults/test_hostile_input.py",
    "faults/test_killed_runs.py::test_a_killed_run_loses_a_chunk_per_worker_at_most_and_is_resumed_to_the_same_bytes[1]",
    "mc_engine/command_line/test_debug.py::test_the_page",
    "mc_engine/flight/cards/test_card_flights.py::test_a_run_on_cards_has_the_bytes_of_one_on_the_processor[minimal",
    "mc_engine/flight/test_model_contract.py::test_shipped_campaigns_keep_the_contract[minimal",
    "mc_engine/flight/test_simulators.py::test_a_case_is_replayed",
    "mc_engine/flight/test_simulators.py::test_each_kind",
    "mc_engine/lanes/test_gauss_jackson.py::test_a_step_integrates",
    "mc_engine/lanes/test_gauss_jackson.py::test_states_that",
    "mc_engine/lanes/test_gauss_jackson.py::test_the_weights",
    "mc_engine/lanes/test_multistep.py::test_the_error_falls_with_the_order_of_the_method[8",
    "mc_engine/lanes/test_phases.py::test_bytes_depend_on_no_width_chunk_thread_or_order[phased_rocket-8-",
    "mc_engine/lanes/test_tables.py::test_a_place_outside_is_the_nearest_one_inside_and_what_is_no_number_breaks_the_flight[8",
    "mc_engine/physics/test_curves.py::test_a_surface_is_scipys_and_meets_its_points[sizes0-linear",
    "mc_engine/physics/test_curves.py::test_what_is_not_a_number_gives_what_is_not_one[even-ends",
    "mc_engine/physics/test_curves_in_models.py::test_a_case_ends",
    "mc_engine/physics/test_rotations.py::test_euler_angles_are_scipys_for_all_twelve_sequences[321",
    "mc_engine/runner/test_contributions.py::test_what_cannot",
    "mc_engine/statistics/test_change_tests.py::test_a_paired_share",
    "mc_engine/statistics/test_change_tests.py::test_a_spread",
    "mc_engine/statistics/test_change_tests.py::test_fewer",
    "mc_engine/statistics/test_change_tests.py::test_holm",
    "mc_engine/statistics/test_change_tests.py::test_newcombes",
    "mc_engine/statistics/test_change_tests.py::test_p_values",
    "mc_engine/statistics/test_change_tests.py::test_the_interval_of_a_paired",
    "mc_engine/statistics/test_change_tests.py::test_the_same_numbers",
    "mc_engine/statistics/test_maps.py::test_two_errors_hold_the_true_surface_whatever_it_is[waves-0.1",
    "mc_engine/statistics/test_rare_events.py::test_a_margin_without",
    "mc_engine/statistics/test_rare_events.py::test_each_level",
    "mc_engine/statistics/test_rare_events.py::test_frequent",
    "mc_engine/statistics/test_rare_events.py::test_importance",
    "mc_engine/statistics/test_rare_events.py::test_runs",
    "mc_engine/statistics/test_rare_events.py::test_the_interval_of_importance",
    "mc_engine/statistics/test_rare_events.py::test_the_interval_on_the_mean_of_runs",
    "mc_engine/statistics/test_rare_events.py::test_what_cannot",
    "mc_engine/statistics/test_time_uniform.py::test_whoever_looks_after_every_case_is_misled_no_more_often_than_promised[0.05",
    "mc_engine/test_interruption.py::test_a_signal_before_anything_is_there_says_so[in a call",
    "mc_engine/test_interruption.py::test_two_signals",
    "reports/formats/test_html.py::test_what_users_write_stays_text[<script>window.struck=1<",
    "reports/formats/test_markdown.py::test_what_users_write_stays_text[<script>window.struck=1<",
    "reports/test_counts_agree.py::test_every_count_of_a_report_is_that_of_the_table[minimal",
    "reports/test_counts_agree.py::test_page_markdown_pdf_and_data_have_the_same_tables_and_cards[minimal",
    "reports/test_counts_agree.py::test_the_data_validate_against_their_schema_and_have_the_numbers_of_the_table[minimal",
    "reports/test_counts_agree.py::test_the_tables_show_the_numbers_of_the_data[minimal",
    "reports/test_counts_agree.py::test_the_worst_cases_of_the_tables_are_those_of_the_data[minimal",
    "reports/user_sections/test_template_bounds.py::test_a_template_without_measure_gets_a_sentence[a macro",
    "reports/user_sections/test_user_sections.py::test_values_of_a_run_are_neither_markdown_nor_templates[{{ 7",
)


def pytest_ignore_collect(collection_path, config):
    """Files with no test but deep ones are not even read where those are left out."""
    name = collection_path.as_posix().rpartition(f"/{TESTS}")[2]
    left_out = config.option.markexpr == "not slow and not deep"  # as pyproject.toml says where nothing else is asked
    deep = name.startswith(DEEP) and not any(kept.startswith(name) for kept in NOT_DEEP)
    return True if left_out and deep and collection_path.is_file() else None


@pytest.hookimpl(tryfirst=True)  # before pytest chooses among the tests by their markers
def pytest_collection_modifyitems(items):
    """Mark the deep tests, of which the slow ones are none."""
    for item in items:
        if item.get_closest_marker("slow"):
            continue
        name = item.nodeid.removeprefix(TESTS)
        long = name.startswith(DEEP) or any(parameter in name for parameter in DEEP_PARAMETERS)
        if item.get_closest_marker("benchmark") or (long and not name.startswith(NOT_DEEP)):
            item.add_marker("deep")


def pytest_terminal_summary(terminalreporter):
    """The table of the numbers of the tests of faults, one line a test."""
    reports = [report for outcome in ("passed", "failed") for report in terminalreporter.stats.get(outcome, ())]
    lines = [
        f"{report.nodeid.removeprefix(FAULTS)}: {', '.join(f'{name} {_shown(value)}' for name, value in said)}"
        for report in reports
        if report.nodeid.startswith(FAULTS) and report.when == "call" and (said := report.user_properties)
    ]
    if lines:
        terminalreporter.write_sep("=", "numbers of the tests of faults")
        terminalreporter.write_line("\n".join(sorted(lines)))


def _shown(value):
    """Many numbers by how many they are, and by their range."""
    if isinstance(value, list | tuple) and len(value) > 1:
        return f"{_shown(min(value))} to {_shown(max(value))} in {len(value)}"
    if isinstance(value, list | tuple):
        return _shown(value[0]) if value else "none"
    return f"{value:.3g}" if isinstance(value, float) else str(value)
