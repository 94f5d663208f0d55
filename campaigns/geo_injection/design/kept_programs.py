"""The source's sequences, whose programs are kept beside the campaign, in `programs/`.

`python -m campaigns.geo_injection.design.kept_programs` designs them again and writes them.
"""

from types import SimpleNamespace
from typing import Any

from campaigns.geo_injection.design.program import KEPT, Sequence, new_design, to_text
from campaigns.geo_injection.model import MODEL, sequence_of


def sequence_with(**settings: Any) -> Sequence:
    """The sequence of the nominal settings but for these, by column name and in declared units."""
    codes = {item.symbol: item.code(settings.get(item.name, item.default)) for item in MODEL.settings}
    return sequence_of(SimpleNamespace(**codes))


SEQUENCES = {
    "two_burns_28_5": sequence_with(),
    "two_burns_55": sequence_with(initial_inclination_deg=55.0),
    "two_burns_planar": sequence_with(planar=True),
    "three_burns_28_5": sequence_with(burns=3),
    "three_burns_planar": sequence_with(burns=3, planar=True),
    "two_burns_28_5_staged": sequence_with(method="staged"),
    "three_burns_28_5_staged": sequence_with(burns=3, method="staged"),
}

if __name__ == "__main__":
    for name, sequence in SEQUENCES.items():
        (KEPT / f"{name}.toml").write_text(to_text(new_design(sequence)), encoding="utf-8", newline="\n")
