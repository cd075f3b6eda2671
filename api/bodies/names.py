"""The bodies that paths lead to."""

from fastapi import Request

from api.common.requests import plant_of
from gateway.rorze.bodies import Body
from gateway.rorze.family import Rorze


def body_of(request: Request, body_id: str) -> Body:
    """Find a body, to tell what is known of it; errors as of `Rorze.body`."""
    return plant_of(request).family(Rorze).body(body_id)
