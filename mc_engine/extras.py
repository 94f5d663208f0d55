"""The packages of the extras that commands ask for, so that a message can say what to install."""

# as in pyproject.toml, which a test holds against this
EXTRAS = {
    "cluster": ("distributed", "dask-jobqueue"),
    "cloud": ("fsspec", "s3fs"),
    "tune": ("pymoo",),
    "docs": ("sphinx", "myst-parser", "furo"),
}


def how_to_install(extra: str) -> str:
    """End of a sentence about a package that is missing: the command that brings all of an extra."""
    return f'`pip install {" ".join(EXTRAS[extra])}` (the extra "{extra}")'
