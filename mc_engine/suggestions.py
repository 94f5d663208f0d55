"""Suggestions for unknown words, for messages that end in "did you mean ...?"."""

from collections.abc import Iterable
from difflib import get_close_matches

# Common synonyms of the campaign file's words; a synonym is suggested only where its word is allowed.
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
    "high": "upper",
    "low": "lower",
    "hours": "h",
    "hrs": "h",
    "kilograms": "kg",
    "kilometers": "km",
    "kilometres": "km",
    "meters": "m",
    "metres": "m",
    "minutes": "min",
    "mtrs": "m",
    "newton": "N",
    "percent": "%",
    "radians": "rad",
    "seconds": "s",
    "amperes": "A",
    "amps": "A",
    "arcminutes": "arcmin",
    "arcseconds": "arcsec",
    "joules": "J",
    "kelvins": "K",
    "dps": "deg/s",
    "kmps": "km/s",
    "mps": "m/s",
    "secs": "s",
    "msecs": "ms",
    "usecs": "us",
    "milliradians": "mrad",
    "newtons": "N",
    "pascals": "Pa",
    "teslas": "T",
    "volts": "V",
    "watts": "W",
}
_MOST_LISTED = 12
_NEAREST_LISTED = 3
_SHORTEST = 3  # letters; too many words of two letters, such as kg and km, differ by one


def nearest(word: str, allowed: Iterable[str]) -> str | None:
    """The allowed word that `word` was probably meant to be, or None."""
    plain, typed = _by_plain_name(allowed), _plain(word)
    if known := synonym(word, plain.values()) or plain.get(typed):
        return known
    slips = [name for name in plain if _is_one_edit(typed, name)]
    matches = get_close_matches(typed, slips or plain, n=1, cutoff=0.0 if slips else 0.6)
    return plain[matches[0]] if matches else None


def synonym(word: str, allowed: Iterable[str]) -> str | None:
    """The allowed word that `word` is another name of, or None."""
    typed = _plain(word)
    meant = _OTHER_NAMES.get(typed) or _OTHER_NAMES.get(f"{typed}s", "")
    return _by_plain_name(allowed).get(meant.lower()) if meant else None


def _plain(word: str) -> str:
    return word.lower().replace("-", "_").replace(" ", "_")


def _by_plain_name(allowed: Iterable[str]) -> dict[str, str]:
    return {name.lower().replace("-", "_"): name for name in allowed}


def _is_one_edit(a: str, b: str) -> bool:
    """True if one letter inserted, deleted or changed, or two neighbours swapped, turns one word into the other.

    Damerau, Communications of the ACM 7 (1964), 171-176: four of five typing errors are one of these.
    """
    if abs(len(a) - len(b)) > 1 or a == b or max(len(a), len(b)) < _SHORTEST:
        return False
    same = next((i for i, (x, y) in enumerate(zip(a, b, strict=False)) if x != y), min(len(a), len(b)))
    rest_a, rest_b = a[same:], b[same:]
    swapped = rest_a[:2] == rest_b[:2][::-1] and rest_a[2:] == rest_b[2:]
    return rest_a[1:] == rest_b[1:] or rest_a[1:] == rest_b or rest_a == rest_b[1:] or swapped


def hint(word: str, allowed: Iterable[str]) -> str:
    """End of a sentence about an unknown word: the nearest allowed word, or a list of the allowed ones."""
    allowed = list(allowed)
    match = nearest(word, allowed)
    if match is not None:
        return f'; did you mean "{match}"?'
    if not allowed:
        return ""
    if len(allowed) > _MOST_LISTED:
        near = get_close_matches(word.lower(), allowed, n=_NEAREST_LISTED, cutoff=0.0)
        return f"; {len(allowed)} are known, nearest are {listed(near)}"
    return f"; known {'is' if len(allowed) == 1 else 'are'} {listed(allowed)}"


def listed(words: Iterable[str]) -> str:
    """The words in quotes, with commas between."""
    return ", ".join(f'"{word}"' for word in words)
