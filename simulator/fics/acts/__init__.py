"""What the commands do, a module a topic of the C-HOST manual; importing them fills the table of actions."""

from importlib import import_module
from pkgutil import iter_modules

for _module in iter_modules(__path__):
    import_module(f"{__name__}.{_module.name}")
