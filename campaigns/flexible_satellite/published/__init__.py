"""What the source prints (`*.toml`), and our values of it that are no metric of a case (`values.py`)."""
