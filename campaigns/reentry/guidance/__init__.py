"""Guidance by a stored reference path: design before the flight, laws in it.

`plan` says what is planned, `reference` flies it (`vinh`) and designs the gains, `reference_table` lays both out for
the flight (`apollo_final_phase` has a table that was flown), and `laws` turns measurements into bank commands.
"""
