"""The packages of each optional extra, so that a message can give the command that installs them."""

# as in pyproject.toml; a test compares them
EXTRAS = {
    "cluster": ("distributed", "dask-jobqueue"),
    "cloud": ("fsspec", "s3fs"),
    "cuda": ("cuda-bindings",),
    "fmu": ("fmpy",),
    "tune": ("pymoo",),
    "docs": ("sphinx", "myst-parser", "furo"),
}


def how_to_install(extra: str) -> str:
    """End of a sentence about a package that is missing: the command that brings all of an extra."""
    return f'`pip install {" ".join(EXTRAS[extra])}` (the extra "{extra}")'
