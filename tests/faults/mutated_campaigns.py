"""Campaign files as a tired hand, a broken disk or an ill will leaves them: mutations of the shipped ones.

Every mutation is a function of a seed alone, so that a number in a failed test finds its file again.
"""

import re
import shutil

from mc_engine.campaign.search import SHIPPED

# Every model, every design, every section, every kind of value.
BASES = (
    "minimal/campaign",
    "deorbit/campaign",
    "deorbit/map",
    "flexible_satellite/dispersed",
    "flexible_satellite/stage_1",
    "flexible_satellite/stage_3",
    "flexible_satellite/thrusters",
    "geo_injection/campaign",
    "geo_injection/one_at_a_time",
    "geo_injection/parking_orbit_errors",
    "geo_servicing/campaign",
    "geo_servicing/inspection",
    "reentry/campaign",
    "reentry/guided",
    "reentry/laws",
    "reentry/from_deorbit",
)

# One of each thing that the shipped files have no need of.
OWN = {
    "minimal/every_distribution": """
[campaign]
model = "model.py"
cases = 2000
design = "lhs"
seed = 1

[parameters]
altitude_km = 300.0

[dispersion.magnitude_error_pct]
dist = "triangular"
half_range = 3.0
unit = "%"

[dispersion.pitch_error_deg]
dist = "beta"
alpha = 2.0
beta = 3.0
lower = -0.02
upper = 0.02
unit = "rad"

[[correlation]]
between = ["magnitude_error_pct", "pitch_error_deg"]
rank = 0.3

[requirement.apogee]
metric = "apogee_altitude_km"
at_least = 600.0
share = 0.9
confidence = 0.90

[retention.histories]
first = 3
cases = [1, 2, 3]
worst = [{ metric = "apogee_altitude_km", count = 5, side = "smallest" }, { metric = "top_speed_m_s" }]
""",
    "minimal/grid": """
[campaign]
model = "model.py"
design = "grid"

[dispersion.magnitude_error_pct]
three_sigma = 3.0
levels = 5

[dispersion.pitch_error_deg]
values = [-1.0, 0.0, 1]
""",
    "minimal/skewed": """
[campaign]
model = "model.py"
cases = 256
design = "sobol"
seed = 1

[dispersion.magnitude_error_pct]
dist = "exponential"
scale = 0.2
upper = 3.0

[dispersion.pitch_error_deg]
dist = "discrete"
values = [-1.0, 0.0, 1.0]
weights = [1, 2, 1]

[dispersion.burn_dv_m_s]
dist = "lognormal"
log_sigma = 0.01
""",
}


def lay_out(folder):
    """Copies of all bases in `folder`, with the files that they read; base -> (path, text)."""
    for shipped in sorted({base.split("/")[0] for base in BASES}):
        (folder / shipped).mkdir()
        for file in SHIPPED.joinpath(shipped).glob("*.csv"):
            shutil.copy(file, folder / shipped)
    shutil.copy(SHIPPED / "minimal" / "model.py", folder / "minimal")
    texts = {base: (SHIPPED / f"{base}.toml").read_text(encoding="utf-8") for base in BASES} | OWN
    return {base: (folder / base.split("/")[0] / "mutated.toml", text) for base, text in texts.items()}


_EXTREMES = (
    "1e400", "-1e400", "nan", "inf", "-inf", "9" * 6000, "-" + "9" * 400, "1e-320", "-0.0", "0", "-1", "1e51", "1e308",
    "9223372036854775808", "0x" + "f" * 300, "true", '""', "[]", "{}", "1979-05-27", "07:32:00", "1_000_000_000",
    '"\\u0000"', '"\\u202e"', '"../../etc/passwd"', '"/dev/zero"', '"' + "x" * 3000 + '"', "[[[]]]", "[nan]",
    "[true, 1, \"a\"]", "{ a = { b = { c = 1 } } }", "'''\n'''", "1979-05-27T00:32:00.999999-07:00", "0.5", "10000000",
)  # fmt: skip


def _lines(text):
    return text.splitlines(keepends=True)


def _delete_lines(text, rng):
    lines = _lines(text)
    first = int(rng.integers(len(lines)))
    del lines[first : first + int(rng.integers(1, 5))]
    return "".join(lines)


def _repeat_lines(text, rng):
    lines = _lines(text)
    first = int(rng.integers(len(lines)))
    block = lines[first : first + int(rng.integers(1, 5))]
    place = int(rng.integers(len(lines)))
    return "".join([*lines[:place], *block, *lines[place:]])


def _swap_lines(text, rng):
    lines = _lines(text)
    a, b = rng.integers(len(lines), size=2)
    lines[a], lines[b] = lines[b], lines[a]
    return "".join(lines)


def _other_value(text, rng):
    values = list(re.finditer(r"(?<==)[^=\n#]+", text))
    match = values[rng.integers(len(values))]
    return text[: match.start()] + " " + _EXTREMES[rng.integers(len(_EXTREMES))] + "\n" + text[match.end() :]


def _value_of_another(text, rng):
    values = list(re.finditer(r"(?<==)[^=\n#]+", text))
    match, other = (values[i] for i in rng.integers(len(values), size=2))
    return text[: match.start()] + other.group() + text[match.end() :]


def _other_section(text, rng):
    headers = list(re.finditer(r"^\[+[^\n]*\]+", text, re.MULTILINE))
    match, other = (headers[i] for i in rng.integers(len(headers), size=2))
    return text[: match.start()] + other.group() + text[match.end() :]


def _cut_off(text, rng):
    return text.encode()[: int(rng.integers(len(text)))]


def _random_bytes(text, rng):
    content = bytearray(text.encode())
    for place in rng.integers(len(content), size=int(rng.integers(1, 9))):
        content[place] = int(rng.integers(256))
    return bytes(content)


def _foreign_letters(text, rng):
    place = int(rng.integers(len(text)))
    odd = ("\x00", "\x1b[2J", "\u202e", "\ufeff", "ａ", "é", "\u0301", "\u2028", "\r", "😀", "\x7f", "\ud7ff")
    return text[:place] + odd[rng.integers(len(odd))] + text[place:]


def _deep(text, rng):
    depth = int(10 ** rng.uniform(1.0, 4.5))
    value = ("[" * depth + "]" * depth, "{a=" * depth + "1" + "}" * depth, "[" * depth)[rng.integers(3)]
    return text + f"\ndeep = {value}\n" if rng.integers(2) else f"deep = {value}\n" + text


def _dotted(text, rng):
    return text + "\n[" + ".".join(["a"] * int(10 ** rng.uniform(1.0, 4.0))) + "]\nx = 1\n"


def _long_list(text, rng):
    count = int(10 ** rng.uniform(2.0, 4.7))
    lists = ("values", "weights", "between", "cases")
    return text + f"\n{lists[rng.integers(4)]} = [{', '.join(['1'] * count)}]\n"


def _encoded(text, rng):
    return text.encode(("utf-16", "utf-8-sig", "latin-1", "utf-32", "cp037")[rng.integers(5)], errors="replace")


_KINDS = (
    _delete_lines, _repeat_lines, _swap_lines, _other_value, _other_value, _other_value, _value_of_another,
    _value_of_another, _other_section, _cut_off, _random_bytes, _foreign_letters, _deep, _dotted, _long_list, _encoded,
)  # fmt: skip


def mutate(text, rng):
    """(kind of the mutation, bytes of the file)."""
    kind = _KINDS[rng.integers(len(_KINDS))]
    mutated = kind(text, rng)
    return kind.__name__, mutated if isinstance(mutated, bytes) else mutated.encode("utf-8", errors="surrogatepass")
