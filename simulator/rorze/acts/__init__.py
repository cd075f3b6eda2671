"""What the commands do, a module a chapter of RC-420 manual 14; importing them fills the table of actions."""

from importlib import import_module
from pkgutil import iter_modules

for _module in iter_modules(__path__):
    import_module(f"{__name__}.{_module.name}")
