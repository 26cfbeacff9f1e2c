"""The formats as JSON Schema, which editors check and complete by while one types."""

from __future__ import annotations

from math import inf
from typing import Any

from pydantic.json_schema import GenerateJsonSchema
from pydantic_core import core_schema

from kbs_process.campaign.formats.campaign_file import CampaignFile
from kbs_process.campaign.formats.mission_file import MissionFile
from kbs_process.campaign.formats.modal_file import ModalFile
from kbs_process.campaign.formats.parameter_file import ParameterFile
from kbs_process.campaign.formats.tables import Table

FORMATS: dict[str, type[Table]] = {
    "campaign": CampaignFile,
    "parameters": ParameterFile,
    "mission": MissionFile,
    "modal": ModalFile,
}


class _Schema(GenerateJsonSchema):
    """TOML has no null: what may be left out is told by the keys that must be there alone."""

    def field_title_should_be_set(self, schema: Any) -> bool:
        return False

    def nullable_schema(self, schema: core_schema.NullableSchema) -> dict[str, Any]:
        return self.generate_inner(schema["schema"])

    def dict_schema(self, schema: core_schema.DictSchema) -> dict[str, Any]:
        made = super().dict_schema(schema)
        return made | {"additionalProperties": False} if "patternProperties" in made else made

    def default_schema(self, schema: core_schema.WithDefaultSchema) -> dict[str, Any]:
        if schema.get("default") in (None, [], {}, "", False, inf) or isinstance(schema.get("default"), Table):
            return self.generate_inner(schema["schema"])
        return super().default_schema(schema)


def schema_of(name: str, model: type[Table]) -> dict[str, Any]:
    """Return the JSON Schema of a format, as a file in schemas/ has it."""
    schema = model.model_json_schema(schema_generator=_Schema)
    head = {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "$id": f"urn:kbs-process:schema:{name}",
        "title": model.model_config["title"],
    }
    return head | schema
