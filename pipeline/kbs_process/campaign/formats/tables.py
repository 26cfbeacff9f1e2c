"""What the formats are made of: texts, numbers, lists, quantities, and tables that know their keys."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Annotated, Any, ClassVar, Self, TypeVar

from pydantic import AfterValidator, BaseModel, ConfigDict, Discriminator, Field, Tag, model_validator
from pydantic_core import PydanticCustomError

from kbs_process.campaign.config import PointingStatistic
from kbs_process.campaign.formats.kind import Kind

# Patterns of texts, and what they ask for in words.
NAME = "^[A-Za-z0-9][A-Za-z0-9._-]*$"
LINK = "^[A-Za-z][A-Za-z0-9_-]*$"
SHA256 = "^[0-9a-f]{64}$"
STREAM = "^(wrench|effort|encoder|rate|command|field|temperature)$"
FORMS = {
    NAME: "letters, digits, '.', '_' and '-', a letter or digit first",
    LINK: "letters, digits, '_' and '-', a letter first",
    STREAM: "wrench, effort, encoder, rate, command, field or temperature",
    SHA256: "the 64 hexadecimal digits of a SHA-256, in small letters",
}

Text = Annotated[str, Field(min_length=1)]
Name = Annotated[str, Field(pattern=NAME)]  # part of a file's name
LinkName = Annotated[str, Field(pattern=LINK)]  # of a joint, a body, a satellite
Checksum = Annotated[str, Field(pattern=SHA256)]
# Plain numbers, such as Hz and s, within what any rig on Earth has.
Positive = Annotated[float, Field(gt=0.0, le=1e9)]
NotNegative = Annotated[float, Field(ge=0.0, le=1e9)]
Magnitude = Annotated[float, Field(ge=-1e9, le=1e9)]


Count = Annotated[int, Field(ge=1, le=1_000_000)]

T = TypeVar("T")


def _distinct(values: list[T]) -> list[T]:
    if len(set(values)) < len(values):
        raise PydanticCustomError("twice", "an element is there twice")
    return values


def _first_version(number: int) -> int:
    if number != 1:
        raise PydanticCustomError("version", "another version")
    return number


# Lists: of one element at least; of elements that differ.
Some = Annotated[list[T], Field(min_length=1)]
Distinct = Annotated[list[T], AfterValidator(_distinct), Field(json_schema_extra={"uniqueItems": True})]
SomeDistinct = Annotated[
    list[T], Field(min_length=1), AfterValidator(_distinct), Field(json_schema_extra={"uniqueItems": True})
]
Version = Annotated[int, AfterValidator(_first_version), Field(json_schema_extra={"const": 1})]

# Alternatives are told apart by what TOML has; their tags stand in a fault's place, and are no keys.
TABLE, ARRAY, TEXT, TRUTH, NUMBER = (Tag(f"\0{kind}") for kind in ("table", "array", "text", "boolean", "number"))
_TAGS = {dict: TABLE, list: ARRAY, str: TEXT, bool: TRUTH, int: NUMBER, float: NUMBER}
TAGS = {tag.tag for tag in _TAGS.values()}


def _kind(value: Any) -> str:
    return _TAGS[type(value)].tag if type(value) in _TAGS else "a date or time"


by_kind = Discriminator(_kind)


def _documented(schema: dict[str, Any], model: type[Table]) -> None:
    """Adapt a table's JSON Schema: kinds of quantities in words, no titles, and what `rules` adds."""
    schema.pop("title", None)
    if model.spread:
        schema.pop("required", None)
    for name, field in model.model_fields.items():
        for kind in field.metadata:
            if isinstance(kind, Kind):
                words = "; ".join(filter(None, (kind.in_words(), field.description)))
                schema["properties"][field.alias or name]["description"] = words
    if model.filled:
        schema["minProperties"] = 1
    schema.update(model.rules)


class Table(BaseModel):
    """A table of a TOML file: other keys than those stated are refused."""

    model_config = ConfigDict(
        extra="forbid", strict=True, frozen=True, allow_inf_nan=False, defer_build=True, json_schema_extra=_documented
    )
    spread: ClassVar[bool] = False  # may its keys be spread over several files?
    together: ClassVar[tuple[str, ...]] = ()  # keys of which all are given, or none
    filled: ClassVar[bool] = False  # must it have a key?
    rules: ClassVar[dict[str, Any]] = {}  # what its JSON Schema says besides

    @model_validator(mode="after")
    def _complete(self) -> Self:
        if self.filled and not self.model_fields_set:
            raise PydanticCustomError("empty", "a table without a key")
        given = [name for name in self.together if name in self.model_fields_set]
        for name in self.together:
            if given and name not in given:
                context = {"key": name, "given": given[0]}
                raise PydanticCustomError("together", "one key is given without the other", context)
        return self


Row = Annotated[Annotated[float, NUMBER] | Annotated[Some[float], ARRAY], by_kind]
Sigma = Annotated[float, Field(ge=0.0)]  # in any unit: bounded in SI
SigmaRow = Annotated[Annotated[Sigma, NUMBER] | Annotated[Some[Sigma], ARRAY], by_kind]


class QuantityTable(Table):
    """A number, array or matrix with its unit, its uncertainty and where it comes from."""

    value: Annotated[Annotated[float, NUMBER] | Annotated[Text, TEXT] | Annotated[Some[Row], ARRAY], by_kind] = Field(
        description="a number, an array, a matrix, or the name of a CSV file that holds one"
    )
    unit: Annotated[Annotated[str, TEXT] | Annotated[list[str], ARRAY], by_kind] = Field(
        description='one for all elements, or a list with one each; "1" without dimension'
    )
    sigma: Annotated[Annotated[Sigma, NUMBER] | Annotated[Text, TEXT] | Annotated[Some[SigmaRow], ARRAY], by_kind] = (
        Field(
            description="one standard deviation, in the same unit; 0 is exact by definition; one number goes for all "
            "elements"
        )
    )
    source: Text = Field(description="where the number comes from")


class PlainQuantity(Table):
    """A number or array that stands in the file itself, with its unit, its uncertainty and where it comes from."""

    value: Row
    unit: Text = Field(description='"1" without dimension')
    sigma: SigmaRow = Field(description="one standard deviation, in the same unit; 0 is exact by definition")
    source: Text = Field(description="where the number comes from")


def quantities(table: Table) -> Iterator[tuple[str, Kind, QuantityTable | PlainQuantity]]:
    """Yield key, kind and what is given of those quantities of a table whose kinds its format states."""
    for name, field in type(table).model_fields.items():
        given = getattr(table, name)
        for kind in field.metadata:
            if isinstance(kind, Kind) and given is not None:
                yield name, kind, given


class LimitTable(Table):
    """What a requirement allows."""

    value: Annotated[float, Field(gt=0.0)]
    unit: Text


class PointingLimitTable(Table):
    """A limit on the pointing error."""

    name: Text
    statistic: PointingStatistic = Field(
        description="2 sigma about the bias; mean; slow variation within one orbit, peak; 95 % of the magnitude; of "
        "each axis, in each section or recording"
    )
    limit: LimitTable
    source: Text
