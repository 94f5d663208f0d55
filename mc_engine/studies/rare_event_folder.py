"""The directory that `mc-engine rare` writes, and its result as text.

    rare.toml   rare.json   cases.parquet   journal.jsonl

The journal holds the checksums of the other files; see `store.result_folder`.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from mc_engine.numbers_in_text import chance_percent, decimals_of, outward, percent_digits
from mc_engine.store.result_folder import read_result
from mc_engine.store.run_files import RARE_EVENT, path_of

if TYPE_CHECKING:
    import pandas as pd

METHOD_WORDS = {
    "subset": "subset simulation",
    "cross-entropy": "importance sampling by cross entropy",
    "plain": "plain cases counted",
}


@dataclass(frozen=True)
class RareEventRecord:
    """A rare-event estimate: `record` is the content of rare.json, `cases` every case flown for it, in order."""

    path: Path
    record: dict[str, Any]
    cases: "pd.DataFrame"

    @property
    def result(self) -> dict[str, Any]:
        return self.record["rare_event"]


def open_rare_event(path: str | Path) -> RareEventRecord:
    """The estimate in directory `path`; StoreError if there is none, or a byte of it changed."""
    path = path_of(path, "a rare event is opened by its path, and {} is none")
    record, tables = read_result(path, RARE_EVENT)
    return RareEventRecord(path, record, tables["cases"])


def rare_event_lines(result: dict[str, Any]) -> Iterator[str]:
    """The result, line by line; `result` is `RareEventRecord.result`."""
    yield f"requirement  {requirement_words(result)}"
    yield f"probability  {probability_words(result)}"
    yield f"cases        {cost_words(result)}"
    yield from _level_lines(result)
    yield from _input_lines(result)
    for remark in result["remarks"]:
        yield f"note         {remark}"


def requirement_words(result: dict[str, Any]) -> str:
    requirement, unit = result["requirement"], result["metric"]["unit"]
    limits = [("at least", requirement["at_least"]), ("at most", requirement["at_most"])]
    texts = [f"{word} {limit:,.12g}{' ' * bool(unit)}{unit}" for word, limit in limits if limit is not None]
    return f"{requirement['name']}: {requirement['metric']} {' and '.join(texts)}"


def probability_words(result: dict[str, Any]) -> str:
    """The estimate, its interval, and what the requirement allows."""
    allowed, sure = 1.0 - result["requirement"]["share"], percent_digits(result["requirement"]["confidence"])
    allows = f"the requirement allows {allowed:.3g} with {sure} % confidence"
    lower, upper = printed_interval(result)
    of = f"{percent_digits(result['confidence'])} % interval"
    if not result["probability"]:
        return f"below {upper:.3g}, the upper end of the {of}; no case was outside the limit ({allows})"
    interval = f"{of} {lower:.3g} to {upper:.3g}"
    return (
        f"{result['probability']:.3g} of not meeting it, {interval}, by {METHOD_WORDS[result['method']]}; "
        f"{allows}, so it is {standing(result)}"
    )


def printed_interval(result: dict[str, Any]) -> tuple[float, float]:
    """Its ends in three significant digits, each rounded outward: what is printed holds what was found."""
    lower, upper = result["lower"], result["upper"]
    return outward(lower, decimals_of(lower, 3), False), outward(upper, decimals_of(upper, 3), True)


def standing(result: dict[str, Any]) -> str:
    """Met, not met, or open: where the interval lies against the share of failures that the requirement allows."""
    allowed = 1.0 - result["requirement"]["share"]
    return "met" if result["upper"] <= allowed else "not met" if result["lower"] > allowed else "open"


def cost_words(result: dict[str, Any]) -> str:
    text = f"{result['cases']:,} flown, {result['failed']:,} of them outside the limit"
    if result["no_number"]:
        text += f" ({result['no_number']:,} without a number)"
    if result["plain_cases"] is None or result["method"] == "plain":
        return text
    return f"{text}; {plain_cases(result):,.0f} plain ones would tell it with the same error"


def plain_cases(result: dict[str, Any]) -> float:
    """Plain cases with the same standard error, in the three digits that such an estimate has."""
    return float(f"{result['plain_cases']:.3g}")


def accepted_percent(level: dict[str, Any]) -> str:
    """The accepted fraction of a level in whole percent; only what is exactly 0 or 1 is printed as 0 or 100."""
    accepted = level["accepted"]
    return chance_percent(accepted, 0) if 0.0 < accepted < 1.0 else f"{100.0 * accepted:.0f}"


def _level_lines(result: dict[str, Any]) -> Iterator[str]:
    unit = result["metric"]["unit"]
    yield f"{'level':<13}{'margin' + (f' [{unit}]' if unit else ''):>16}{'probability':>13}{'cases':>9}{'accepted':>10}"
    for number, level in enumerate(result["levels"]):
        margin = "all" if level["margin"] is None else f"{level['margin']:.4g}"
        accepted = f"{accepted_percent(level)} %"
        yield f"{number:<13}{margin:>16}{level['probability']:>13.3g}{level['cases']:>9,}{accepted:>10}"


def _input_lines(result: dict[str, Any]) -> Iterator[str]:
    if not result["inputs"]:
        return
    width = max(len(record["name"]) for record in result["inputs"])
    across = result["inputs"][0].get("across") is not None
    ends = "the likeliest, and the one across" if across else "the likeliest"
    yield f"cases outside the limit, by input: mean and spread in sigmas; {ends}"
    for record in sorted(result["inputs"], key=lambda item: -abs(item["likeliest_sigma"])):
        texts = [
            f"{record[case]:.5g}{' ' * bool(record['unit'])}{record['unit']} ({record[f'{case}_sigma']:+.2f} σ)"
            for case in ("likeliest", "across")
            if record.get(case) is not None
        ]
        mean, spread = record["mean_sigma"], record["spread_sigma"]
        yield f"  {record['name']:<{width}}  {mean:+.2f} ± {spread:.2f} σ;  {'; '.join(texts)}"
