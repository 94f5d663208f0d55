"""Guidance by a stored reference: `plan` and `reference` design it, `reference_table` stores it, `laws` fly by it."""
