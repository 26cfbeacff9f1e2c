"""The JSON Schemas in schemas/, and what they say about a tree, in words."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

from jsonschema import Draft202012Validator
from jsonschema.exceptions import ValidationError

import kbs_process
from kbs_process.campaign.documents import Key
from kbs_process.errors import did_you_mean


@dataclass(frozen=True, slots=True)
class Violation:
    """One thing that a schema does not allow."""

    key: Key
    what: str
    remedy: str


def schema_folder() -> Path:
    """Return the folder of the schemas: inside an installed package, or schemas/ of a checkout."""
    package = Path(kbs_process.__file__).parent
    installed = package / "schemas"
    return installed if installed.is_dir() else package.parents[1] / "schemas"


@cache
def load_schema(name: str) -> dict[str, Any]:
    """Return the schema `name`: "campaign", "parameters" or "results"."""
    text = (schema_folder() / f"{name}.schema.json").read_text(encoding="utf-8")
    schema: dict[str, Any] = json.loads(text)
    return schema


def violations(tree: Any, name: str, definition: str = "") -> Iterator[Violation]:
    """Yield what is wrong with `tree` according to a schema, or to one of its `$defs`."""
    schema = load_schema(name)
    if definition:
        schema = {"$ref": f"#/$defs/{definition}", "$defs": schema["$defs"]}
    errors = Draft202012Validator(schema).iter_errors(tree)
    for error in sorted(errors, key=lambda error: [str(part) for part in error.absolute_path]):
        yield from _explain(error)


def _explain(error: ValidationError) -> Iterator[Violation]:
    key: Key = tuple(error.absolute_path)
    found: Any = error.instance
    rule: Any = error.validator_value
    match error.validator:
        case "additionalProperties":
            known = error.schema.get("properties", {}) if isinstance(error.schema, dict) else {}
            for name in sorted(set(found) - set(known)):
                yield Violation((*key, name), "is not a key that is known here", did_you_mean(name, known, taken=found))
        case "required":
            for name in sorted(set(rule) - set(found)):
                yield Violation((*key, name), "is missing", _how_to_give(name))
        case "dependentRequired":
            for present, others in rule.items():
                for name in sorted(set(others) - set(found)) if present in found else ():
                    yield Violation((*key, name), f"is missing, although {present} is given", _how_to_give(name))
        case "enum":
            yield Violation(key, f"{_show(found)} is not allowed", did_you_mean(str(found), map(str, rule)))
        case "const":
            yield Violation(key, f"is {_show(found)}, not {_show(rule)}", f"this version reads {_show(rule)} only")
        case "type" if rule == "array" and isinstance(found, dict):
            yield Violation(key, "is one table, not a list of tables", f"write [[{key[-1]}]], in double brackets")
        case "type":
            allowed = " or ".join(_TYPES[kind] for kind in ([rule] if isinstance(rule, str) else rule))
            yield Violation(key, f"{_show(found)} is {_kind(found)}, not {allowed}", f"write {allowed}")
        case _:
            yield Violation(key, *_limits(str(error.validator), found, rule))


def _limits(rule: str, found: Any, limit: Any) -> tuple[str, str]:
    """Return what is wrong and the remedy where a value breaks a numerical or textual limit."""
    match rule:
        case "minimum":
            return f"{found} is less than {limit}", f"give at least {limit}"
        case "exclusiveMinimum":
            return f"{found} is not greater than {limit}", f"give more than {limit}"
        case "maximum":
            return f"{found} is greater than {limit}", f"give at most {limit}"
        case "minItems":
            return f"has {len(found)} elements, fewer than {limit}", f"give at least {limit}"
        case "maxItems":
            return f"has {len(found)} elements, more than {limit}", f"give at most {limit}"
        case "minProperties":
            return "is empty", "describe at least one"
        case "minLength":
            return "is empty", "fill it in"
        case "uniqueItems":
            return f"{_show(found)} holds an element twice", "keep one of them"
        case "pattern":
            return (f"{_show(found)} does not have the form {limit}", "use the characters that this form allows")
        case _:
            return f"{_show(found)} does not satisfy {rule} = {_show(limit)}", "see the schema"


_TYPES = {
    "object": "a table",
    "array": "an array",
    "string": "a text",
    "number": "a number",
    "integer": "a whole number",
    "boolean": "true or false",
    "null": "nothing",
}

_REMEDIES = {
    "sigma": "give one standard deviation, in the same unit; 0.0 is exact by definition",
    "unit": 'give the unit, such as unit = "N m"; "1" for a number without dimension',
    "source": "say where the number comes from",
}


def _how_to_give(name: str) -> str:
    return _REMEDIES.get(name, f"add the key '{name}'")


def _kind(value: Any) -> str:
    kinds: dict[type, str] = {dict: "object", list: "array", str: "string", bool: "boolean", int: "integer"}
    return _TYPES.get(kinds.get(type(value), ""), "a number" if isinstance(value, float) else "a date or time")


def _show(value: Any) -> str:
    text = f"'{value}'" if isinstance(value, str) else str(value)
    return text if len(text) <= 60 else text[:57] + "..."
