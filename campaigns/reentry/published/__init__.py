"""What public sources print (`*.toml`), and our values of it that are no metric of a case."""
