"""The reference of campaign-file keys, from the JSON schema of the file."""

import json
import re
from collections.abc import Iterator, Mapping
from typing import Any

from mc_engine.campaign.sections import schema
from mc_engine.documentation.markdown_text import code, escaped, table

_HEAD = """# Keys of a campaign file

Made from the JSON schema, which `mc-engine schema` prints for an editor. Other keys are errors. `mc-engine check FILE`
reports all errors of a file at once, each with its location and the allowed values. Numbers are in the units of the
model's parameters and metrics, see the pages of the campaigns.
"""


def page() -> str:
    """One section per table of the file, one row per key."""
    document = schema()
    definitions = document["$defs"]
    parts = [_HEAD]
    parts += _section("A file", document, definitions)
    for name, definition in sorted(definitions.items(), key=lambda entry: entry[0].endswith("Dispersion")):
        parts += _section(_title(name), definition, definitions)
    return "\n".join(parts)


def _title(name: str) -> str:
    for ending, kind in (("Dispersion", "distribution "), ("Section", "section ")):
        if name.endswith(ending):
            return kind + re.sub("(?<=[a-z])(?=[A-Z])", " ", name.removesuffix(ending)).lower()
    return name


def _section(title: str, definition: Mapping[str, Any], definitions: Mapping[str, Any]) -> Iterator[str]:
    yield f"## {title[:1].upper()}{title[1:]}\n"
    if text := definition.get("description"):
        yield f"{escaped(text)}\n"
    required = definition.get("required", ())
    rows = [
        (
            code(key),
            _type_text(record, definitions),
            "required" if key in required else _default(record),
            escaped(record.get("description", "")),
        )
        for key, record in definition.get("properties", {}).items()
    ]
    yield table(("Key", "Value", "Default", "Meaning"), rows) + "\n"


def _default(record: Mapping[str, Any]) -> str:
    value = record.get("default")
    return "" if value in (None, "") or isinstance(value, dict) else code(json.dumps(value))


def _type_text(record: Mapping[str, Any], definitions: Mapping[str, Any]) -> str:
    """What a value may be, in words."""
    for several in ("anyOf", "oneOf"):
        if several in record:
            words = [_type_text(choice, definitions) for choice in record[several] if choice.get("type") != "null"]
            return " or ".join(dict.fromkeys(words))
    if "$ref" in record:
        name = record["$ref"].rsplit("/", 1)[-1]
        title = _title(name)
        return f"[{title}](#{title.replace(' ', '-')})"
    if "const" in record:
        return code(json.dumps(record["const"]))
    if "enum" in record:
        return ", ".join(code(json.dumps(word)) for word in record["enum"])
    if record.get("type") == "array":
        return f"list of: {_type_text(record.get('items', {}), definitions)}"
    if record.get("type") == "object":
        inner = record.get("additionalProperties")
        return f"tables by name, each: {_type_text(inner, definitions)}" if isinstance(inner, dict) else "table"
    return _WORDS.get(record.get("type", ""), "any") + _allowed_range(record)


_WORDS = {"string": "text", "integer": "whole number", "number": "number", "boolean": "true or false"}
_LARGEST = 1e40  # limits beyond it keep arithmetic finite and are of no interest to a reader


def _allowed_range(record: Mapping[str, Any]) -> str:
    words = {"minimum": "≥", "exclusiveMinimum": "\\>", "maximum": "≤", "exclusiveMaximum": "\\<"}
    limits = [f"{sign} {record[key]:g}" for key, sign in words.items() if abs(record.get(key, 1e50)) < _LARGEST]
    return f" {', '.join(limits)}" if limits else ""
