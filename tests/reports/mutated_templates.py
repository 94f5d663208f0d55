"""Templates that a sandbox alone does not bound, and what is said of each."""

DEEP = "nested too deep"
MEMORY = "MiB of memory|its memory"
TIME = "takes more than"


def _loop(*names, body=""):
    return "".join(f"{{% for {name} in range(99999) %}}" for name in names) + body + "{% endfor %}" * len(names)


BOMBS = {
    "a macro that calls itself": ("# A\n{% macro f() %}{{ f() }}{% endmacro %}{{ f() }}", DEEP),
    "500 parentheses": ("# A\n{{ " + "(" * 500 + "1" + ")" * 500 + " }}", f"{DEEP}|too many nested"),
    "50000 parentheses": ("# A\n{{ " + "(" * 50_000 + "1" + ")" * 50_000 + " }}", DEEP),
    "300 conditions": ("# A\n" + "{% if 1 %}" * 300 + "{% endif %}" * 300, f"{DEEP}|too many"),
    "a word of 10 GB": ("# A\n{{ 'a' * 10**10 }}", MEMORY),
    "a word that doubles": (
        "# A\n{% set n = namespace(x='a') %}{% for a in range(60) %}{% set n.x = n.x ~ n.x %}{% endfor %}", MEMORY),
    "a wide format": ("# A\n{{ '%3000000000d' % 1 }}", f"{MEMORY}|too"),
    "a wide format of another kind": ("# A\n{{ '{:1000000000}'.format(1) }}", MEMORY),
    "a centred word": ("# A\n{{ 'a'|center(10**10) }}", MEMORY),
    "a power of powers": ("# A\n{{ 10**(10**10) }}", TIME),
    "loops in loops": ("# A\n" + _loop("a", "b"), TIME),
    "a long text": ("# A\n" + _loop("a", body="{{ 'abcdefghijklmnopqrstuvwxyz' }}"), "letters"),
}  # fmt: skip
