"""Texts that try to become more than text, in a page, a typeset document, Markdown or a template."""

import pytest
from synthetic_run import synthetic_run

PAYLOADS = [
    "<script>window.struck=1</script>",
    "</script><script>window.struck=2</script>",
    "<!--<script>",
    "--><script>window.struck=3</script>",
    "<img src=x onerror=window.struck=4>",
    '" onmouseover="window.struck=5',
    "' onfocus='window.struck=6' autofocus='",
    "{{ 7 * 7 }}{% raw %}",
    "{{ self.__init__.__globals__ }}",
    "javascript:window.struck=7",
    '<a href="javascript:window.struck=8">x</a>',
    "]]><svg/onload=window.struck=9>",
    "<svg><script>window.struck=10</script></svg>",
    "<iframe srcdoc='<script>parent.struck=11</script>'>",
    "<style>*{display:none}</style>",
    "</style><script>window.struck=12</script>",
    "</title><script>window.struck=13</script>",
    "</textarea><script>window.struck=14</script>",
    "<base href='https://example.invalid/'>",
    "<link rel=stylesheet href=https://example.invalid/x.css>",
    "<meta http-equiv=refresh content='0;url=https://example.invalid/'>",
    "<object data=https://example.invalid/>",
    "<form action=https://example.invalid/><button>x",
    "&lt;script&gt;window.struck=15&lt;/script&gt;",
    "&#60;img src=x onerror=window.struck=16&#62;",
    "\\u003cscript\\u003ewindow.struck=17",
    "![x](https://example.invalid/x.png)",
    "[x](javascript:window.struck=18) <https://example.invalid/>",
    "`x` | y | **z** # $a$ ~~b~~",
    '#panic("x") @ref <label> $x^2$',
    "<template><script>window.struck=19</script></template>",
    "<math><mtext></form><form><mglyph><style></math><img src onerror=window.struck=20>",
]
# for a report each: every sixth, and the others among the slow tests; a browser gets all of them in one page
ONE_BY_ONE = [p if k % 6 == 0 else pytest.param(p, marks=pytest.mark.slow) for k, p in enumerate(PAYLOADS)]


def hostile(text, others=()):
    """A run with the same text wherever a user may write; `others` as columns' descriptions, one each."""
    run = synthetic_run(60, failed=5, figures=[
        {"kind": "map", "metric": "propellant_kg", "x": "ve_pct", "y": "oe_pct", "title": text},
        {"kind": "scatter", "x": "propellant_kg", "y": "peak_force_n", "title": text},
    ])  # fmt: skip
    manifest = run.manifest
    manifest["campaign"] |= {"name": text, "title": text, "model": text}
    manifest["model"] |= {"title": text, "source": text}
    manifest["requirements"][0]["name"] = text
    for record in [*manifest["inputs"], *manifest["parameters"], *manifest["columns"], *manifest["settings"]]:
        record["description"] = text
    for record, other in zip(manifest["columns"], others, strict=False):
        record["description"] = other
    manifest["inputs"][0]["source"] = manifest["published"][0]["note"] = manifest["published"][0]["quantity"] = text
    run.table.loc[run.table["status"] != "ok", "reason"] = text
    return run
