"""What is wrong with a file, in words: every fault at once, with its place and a remedy."""

from __future__ import annotations

import types
from collections.abc import Iterator
from datetime import datetime
from typing import Annotated, Any, TypeVar, Union, get_args, get_origin

from pydantic import ValidationError
from pydantic_core import ErrorDetails

from kbs_process.campaign.documents import Document, Key, Merged
from kbs_process.campaign.formats.tables import FORMS, TAGS, Table
from kbs_process.campaign.problems import Problems
from kbs_process.errors import did_you_mean

T = TypeVar("T", bound=Table)
Fault = tuple[Key, str, str]  # where, what is wrong, remedy


def checked(source: Document | Merged, model: type[T], problems: Problems) -> T:
    """Return the tables of a file, or of several that were merged, as `model`.

    Raises ConfigError that tells everything that `problems` has and all that does not fit the model.
    """
    found = None
    try:
        found = model.model_validate(source.tree)
    except ValidationError as error:
        for key, what, remedy in _faults(model, error):
            problems.add(source.place(key), what, remedy)
    problems.raise_any()
    assert found is not None
    return found


def _faults(model: type[Table], error: ValidationError) -> Iterator[Fault]:
    told = [_fault(model, entry) for entry in error.errors(include_url=False)]
    # A key that is missing because it is misspelt is told once.
    meant = {(*key[:-1], remedy) for key, _, remedy in told}
    for key, what, remedy in told:
        if what != "is missing" or (*key[:-1], f"did you mean '{key[-1]}'?") not in meant:
            yield key, what, remedy


def _fault(model: type[Table], entry: ErrorDetails) -> Fault:
    kind, found, context = entry["type"], entry["input"], entry.get("ctx", {})
    # Tags of alternatives are no keys, nor is what marks the key itself.
    key: Key = tuple(part for part in entry["loc"] if part not in TAGS)
    if kind.startswith("string_") and key[-1:] == ("[key]",):
        key = key[:-1]
    match kind:
        case "extra_forbidden":
            (table,) = (one for one in _allowed(model, key[:-1]) if _is_table(one))
            known = {field.alias or name for name, field in table.model_fields.items()}
            return key, "is not a key that is known here", did_you_mean(str(key[-1]), known)
        case "missing":
            return key, "is missing", _how_to_give(str(key[-1]))
        case "together":
            name = context["key"]
            return (*key, name), f"is missing, although {context['given']} is given", _how_to_give(name)
        case "literal_error":
            values = [value for one in _allowed(model, key) for value in get_args(one)]
            return key, f"{_shown(found)} is not allowed", did_you_mean(found if isinstance(found, str) else "", values)
        case "version":
            return key, f"is {_shown(found)}, not 1", "this version reads 1 only"
        case "finite_number":
            return key, f"{found} is not a finite number", "give the number, or ask its source"
        case "timezone_aware" | "datetime_type":
            return key, "is no date and time with its offset from UTC", "write it as 1999-12-01T15:30:00Z"
        case _ if kind.endswith("_type") or kind == "union_tag_invalid":
            return key, *_other_type(_allowed(model, key), key, found)
        case _:
            return key, *_limits(kind, found, context)


def _other_type(allowed: list[Any], key: Key, found: Any) -> tuple[str, str]:
    """Return what is wrong and the remedy where TOML has another type than a key takes."""
    lists_tables = any(get_origin(one) is list and any(map(_is_table, _plain(*get_args(one)))) for one in allowed)
    if isinstance(found, dict) and lists_tables:
        return "is one table, not a list of tables", f"write [[{key[-1]}]], in double brackets"
    if isinstance(found, list) and found and isinstance(found[0], dict) and any(map(_is_table, allowed)):
        return "is a list of tables, not one table", f"write [{key[-1]}], in single brackets"
    if type(found) is int and float in allowed:
        return f"{_shown(found)} is beyond all numbers that can be computed with", "give less than 1e308"
    if isinstance(found, float) and int in allowed and found.is_integer():
        return (
            f"{_shown(found)} is no whole number as TOML writes one",
            f"write {_shown(int(found))}, without a point",
        )
    wanted = " or ".join(dict.fromkeys(_TYPES.get(get_origin(one) or one, "a table") for one in allowed))
    needed = [
        name for one in allowed if _is_table(one) for name in one.model_fields if one.model_fields[name].is_required()
    ]
    remedy = (
        f"write {{ {', '.join(f'{name} = ...' for name in needed)} }}" if 0 < len(needed) < 5 else f"write {wanted}"
    )
    if isinstance(found, bool):
        return f"{_shown(found)} is not {wanted}", remedy
    return f"{_shown(found)} is {_TYPES.get(type(found), 'a date or time')}, not {wanted}", remedy


def _limits(kind: str, found: Any, context: dict[str, Any]) -> tuple[str, str]:
    """Return what is wrong and the remedy where a value breaks a numerical or textual limit."""
    match kind:
        case "greater_than_equal":
            return f"{_shown(found)} is less than {context['ge']:g}", f"give at least {context['ge']:g}"
        case "greater_than":
            return f"{_shown(found)} is not greater than {context['gt']:g}", f"give more than {context['gt']:g}"
        case "less_than_equal":
            return f"{_shown(found)} is greater than {context['le']:g}", f"give at most {context['le']:g}"
        case "less_than":
            return f"{_shown(found)} is not less than {context['lt']:g}", f"give less than {context['lt']:g}"
        case "empty" | "too_short" if isinstance(found, dict):
            return "is empty", "describe at least one"
        case "too_short":
            least = context["min_length"]
            return f"has {len(found)} elements, fewer than {least}", f"give at least {least}"
        case "too_long":
            most = context["max_length"]
            return f"has {len(found)} elements, more than {most}", f"give at most {most}"
        case "string_too_short":
            return "is empty", "fill it in"
        case "string_too_long":
            most = context["max_length"]
            return f"{_shown(found)} is longer than {most} characters", "make it shorter"
        case "twice":
            return f"{_shown(found)} holds an element twice", "keep one of them"
        case "string_pattern_mismatch":
            return f"{_shown(found)} does not have the form that is asked for", f"use {FORMS[context['pattern']]}"
        case _:
            return f"{_shown(found)} is not allowed", "see the format's schema"


_TYPES: dict[Any, str] = {
    dict: "a table",
    list: "an array",
    str: "a text",
    float: "a number",
    int: "a whole number",
    bool: "true or false",
    datetime: "a date or time",
}

_REMEDIES = {
    "sigma": "give one standard deviation, in the same unit; 0.0 is exact by definition",
    "unit": 'give the unit, such as unit = "N m"; "1" for a number without dimension',
    "source": "say where the number comes from",
}


def _how_to_give(name: str) -> str:
    return _REMEDIES.get(name, f"add the key '{name}'")


def _shown(value: Any) -> str:
    if isinstance(value, int) and abs(value) > 10**18:
        return f"{value:#x}"[:20] + "..."  # Python writes no number of very many digits
    text = f"'{value}'" if isinstance(value, str) else str(value).lower() if isinstance(value, bool) else str(value)
    return text if len(text) <= 60 else text[:57] + "..."


def _allowed(model: type[Table], key: Key) -> list[Any]:
    """What a model takes at a key: classes, Literals, lists and dicts, alternatives one by one."""
    found: list[Any] = [model]
    for part in key:
        found = [plain for one in found for inner in _inside(one, part) for plain in _plain(inner)]
    return found


def _inside(annotation: Any, part: str | int) -> Iterator[Any]:
    if _is_table(annotation):
        yield from (
            field.annotation for name, field in annotation.model_fields.items() if (field.alias or name) == part
        )
    elif get_origin(annotation) in (list, dict):
        yield get_args(annotation)[-1]


def _plain(*annotations: Any) -> Iterator[Any]:
    for one in annotations:
        if get_origin(one) is Annotated:
            yield from _plain(get_args(one)[0])
        elif get_origin(one) in (Union, types.UnionType):
            yield from _plain(*get_args(one))
        elif one is not type(None):
            yield one


def _is_table(annotation: Any) -> bool:
    return isinstance(annotation, type) and issubclass(annotation, Table)
