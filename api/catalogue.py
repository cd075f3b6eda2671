"""The command tables over HTTP: documents that are written once."""

from collections.abc import Mapping
from functools import partial
from typing import Final, get_args

from fastapi import Request, Response

from api.common.requests import new_router
from api.front.documents import JSON, Document
from gateway.door.catalogue import CommandList, Family, FamilyName, tables_of
from gateway.door.table import Right

router = new_router("commands")


@router.get("/commands", Right.VIEW, any_scope=True, response_model=CommandList)
async def list_commands(request: Request, family: FamilyName = None) -> Response:
    """List every command that controllers and robots know."""
    return await TABLES[family].send(request)


def _written(*families: Family) -> bytes:
    return tables_of(*families).model_dump_json().encode()


TABLES: Final[Mapping[Family | None, Document]] = {
    None: Document(JSON, partial(_written, *get_args(Family))),
    **{family: Document(JSON, partial(_written, family)) for family in get_args(Family)},
}
"""The answers: all commands, and those of each family."""
