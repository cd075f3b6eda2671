"""The actions of the commands, a module a chapter of RC-420 manual 14; imports fill their table."""

from importlib import import_module
from pkgutil import iter_modules

for _module in iter_modules(__path__):
    import_module(f"{__name__}.{_module.name}")
