"""All routes of robots."""

from fastapi import APIRouter

from api.robots import info, jogs, moves, positions, settings, signals


def routers() -> list[APIRouter]:
    """The routers of every module here."""
    modules = (info, moves, jogs, positions, settings, signals)
    return [module.router for module in modules]
