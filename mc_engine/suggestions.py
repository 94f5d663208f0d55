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
    "degree": "deg",
    "degrees": "deg",
    "hours": "h",
    "kilograms": "kg",
    "kilometers": "km",
    "kilometres": "km",
    "meters": "m",
    "metres": "m",
    "newton": "N",
    "percent": "%",
    "radians": "rad",
    "seconds": "s",
    "amperes": "A",
    "arcminutes": "arcmin",
    "arcseconds": "arcsec",
    "joules": "J",
    "kelvins": "K",
    "milliradians": "mrad",
    "newtons": "N",
    "pascals": "Pa",
    "teslas": "T",
    "volts": "V",
    "watts": "W",
}
_FEW = 12
_NEAR = 3
_SHORTEST = 3  # letters; of two-letter words, such as kg and km, too many are one slip apart


def nearest(word: str, allowed: Iterable[str]) -> str | None:
    """The allowed word that `word` was probably meant to be, or None."""
    plain = {name.lower().replace("-", "_"): name for name in allowed}
    wanted = word.lower().replace("-", "_").replace(" ", "_")
    other = (_OTHER_NAMES.get(wanted) or _OTHER_NAMES.get(f"{wanted}s", "")).lower()
    if other and other in plain:
        return plain[other]
    if wanted in plain:
        return plain[wanted]
    slips = [name for name in plain if _one_slip_apart(wanted, name)]
    matches = get_close_matches(wanted, slips or plain, n=1, cutoff=0.0 if slips else 0.6)
    return plain[matches[0]] if matches else None


def _one_slip_apart(one: str, other: str) -> bool:
    """True where a letter too many, too few or changed, or two neighbours swapped, makes one word of the other.

    Damerau, Communications of the ACM 7 (1964), 171-176: four in five slips of a keyboard are one of these.
    """
    if abs(len(one) - len(other)) > 1 or one == other or max(len(one), len(other)) < _SHORTEST:
        return False
    same = next((i for i, (a, b) in enumerate(zip(one, other, strict=False)) if a != b), min(len(one), len(other)))
    rest, its = one[same:], other[same:]
    swapped = rest[:2] == its[:2][::-1] and rest[2:] == its[2:]
    return rest[1:] == its[1:] or rest[1:] == its or rest == its[1:] or swapped


def hint(word: str, allowed: Iterable[str]) -> str:
    """End of a sentence about an unknown word: the nearest one, or else all of them, or the nearest few."""
    allowed = list(allowed)
    match = nearest(word, allowed)
    if match is not None:
        return f'; did you mean "{match}"?'
    if not allowed:
        return ""
    if len(allowed) > _FEW:
        near = get_close_matches(word.lower(), allowed, n=_NEAR, cutoff=0.0)
        return f"; {len(allowed)} are known, nearest are {listed(near)}"
    return f"; known {'is' if len(allowed) == 1 else 'are'} {listed(allowed)}"


def listed(words: Iterable[str]) -> str:
    """The words in quotes, with commas between."""
    return ", ".join(f'"{word}"' for word in words)
