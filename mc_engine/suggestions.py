"""The nearest of the words that are allowed, for messages that end in "did you mean ...?"."""

from collections.abc import Iterable
from difflib import get_close_matches

# What engineers type first, and the words of the campaign file for it; used only where that word is allowed.
_OTHER_NAMES = {
    "average": "mean",
    "binomial": "discrete",
    "const": "constant",
    "distribution": "dist",
    "factorial": "grid",
    "fixed": "constant",
    "full_factorial": "grid",
    "gauss": "normal",
    "gaussian": "normal",
    "latin_hypercube": "lhs",
    "max": "upper",
    "maximum": "upper",
    "min": "lower",
    "minimum": "lower",
    "monte_carlo": "mc",
    "n": "cases",
    "n_cases": "cases",
    "oat": "one_at_a_time",
    "random": "mc",
    "random_seed": "seed",
    "rectangular": "uniform",
    "rho": "rank",
    "runs": "cases",
    "samples": "cases",
    "std": "sigma",
    "stddev": "sigma",
    "3sigma": "three_sigma",
}
_FEW = 12


def nearest(word: str, allowed: Iterable[str]) -> str | None:
    """The allowed word that `word` was probably meant to be, or None."""
    plain = {name.lower().replace("-", "_"): name for name in allowed}
    wanted = word.lower().replace("-", "_").replace(" ", "_")
    other = _OTHER_NAMES.get(wanted, "")
    if other in plain:
        return plain[other]
    matches = get_close_matches(wanted, plain, n=1, cutoff=0.6)
    return plain[matches[0]] if matches else None


def hint(word: str, allowed: Iterable[str]) -> str:
    """End of a sentence about an unknown word: the nearest one, or else all of them where they are few."""
    allowed = list(allowed)
    match = nearest(word, allowed)
    if match is not None:
        return f'; did you mean "{match}"?'
    if not allowed:
        return ""
    if len(allowed) > _FEW:
        return f"; {len(allowed)} are known, among them {listed(allowed[:3])}"
    return f"; known {'is' if len(allowed) == 1 else 'are'} {listed(allowed)}"


def listed(words: Iterable[str]) -> str:
    """The words in quotes, with commas between."""
    return ", ".join(f'"{word}"' for word in words)
