"""Records of long work over HTTP: found by their ids, and what is under way cancelled."""

from dataclasses import dataclass
from typing import Any

from fastapi import Request, Response
from pydantic import BaseModel

from api.common.parameters import taking
from api.common.requests import json_response, origin, plant_of, wait_headers, wait_s
from api.common.routes import Router
from gateway.core.operation import Wait
from gateway.core.rights import Right
from gateway.operations.records import Records


@dataclass(frozen=True)
class RecordRoutes:
    """The routes of the records of one kind of long work."""

    one: str
    """What people call a record, such as `a backup`."""
    model: type[BaseModel]
    records: Records[Any]
    when_cancelled: str

    def add_to(self, router: Router, path: str, get_name: str, cancel_name: str, **names: Any) -> None:
        """Add them at a path such as `/bodies/{body_id}/backups`, with the `names` in it."""
        record_id = f"{path.rpartition('/')[2][:-1]}_id"
        worked_on = "/".join(path.split("/")[:3])

        async def get(request: Request, wait: float | None = None, **values: str) -> Response:
            waited_s, wanted = wait_s(request, wait), values.pop(record_id)
            target = worked_on.format(**values)
            record = await self.records.get(plant_of(request), target, wanted, waited_s)
            return json_response(record, headers=wait_headers(waited_s))

        async def cancel(request: Request, **values: str) -> Response:
            plant, target = plant_of(request), worked_on.format(**values)
            return json_response(await self.records.cancel(plant, origin(), target))

        router.add(
            "GET",
            f"{path}/{{{record_id}}}",
            Right.VIEW,
            taking(get, {**names, record_id: str, "wait": Wait}),
            name=get_name,
            description=f"Get {self.one}, at once or when it is over; `current` is the one under way, or the "
            "last.",
            response_model=self.model,
        )
        router.add(
            "DELETE",
            f"{path}/current",
            self.records.may_cancel,
            taking(cancel, names),
            name=cancel_name,
            description=self.when_cancelled,
            response_model=self.model,
        )
