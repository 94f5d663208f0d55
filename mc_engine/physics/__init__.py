"""Physics that two or more campaigns share."""
