"""Marks that members of records carry into the documents."""

from typing import Final

from pydantic import JsonValue

DETAIL: Final[dict[str, JsonValue]] = {"x-detail": True}
"""`json_schema_extra` of a member whose form the core of the documents leaves open."""
