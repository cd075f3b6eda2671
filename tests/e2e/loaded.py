"""Imports and data that every program of a test needs, loaded once before the first is started."""

import gc
from pathlib import Path

import simulator.cli  # noqa: F401
from api.app import create_app
from app import server as _server  # noqa: F401
from app.demo import demo_config
from gateway.plant import Plant

create_app(Plant(demo_config(Path("/nowhere"), Path("/nowhere"), port=0)))
gc.collect()
gc.freeze()  # the programs share what is there
