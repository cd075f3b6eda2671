"""Words of the rows of the door, where the command line says the same thing.

The table takes half a second to load: it is read when help is shown, and no command waits for it.
"""

from typing import Any, Final

from typer.core import TyperCommand

_FROM_ROW: Final = "\0"


def of(operation: str, member: str) -> str:
    """The help of an option that is a member of an operation's request, or a parameter of its query."""
    return f"{_FROM_ROW}{operation}.{member}"


class WordedCommand(TyperCommand):
    """A command whose options may have the words of rows."""

    def format_help(self, ctx: Any, formatter: Any) -> None:
        """Show the help."""
        self._put_words_in()
        super().format_help(ctx, formatter)

    def shell_complete(self, ctx: Any, incomplete: str) -> Any:
        """Complete what is typed; shells show the help of options beside them."""
        if incomplete.startswith("-"):
            self._put_words_in()
        return super().shell_complete(ctx, incomplete)

    def _put_words_in(self) -> None:
        for param in self.params:
            text = getattr(param, "help", None)
            if text is not None and text.startswith(_FROM_ROW):
                words = told(*text.removeprefix(_FROM_ROW).split("."))
                param.help = words.replace("[", r"\[")  # type: ignore[attr-defined]  # no markup


def told(operation: str, member: str) -> str:
    """The description of a member of an operation's request, or of a parameter, in its row.

    :raises KeyError: it has none of this name.
    :raises ValueError: there is no such operation.
    """
    from gateway.door import operations

    [row] = (candidate for candidate in operations() if candidate.name == operation)
    if row.request is not None and member in row.request.model_fields:
        return str(row.request.model_fields[member].description)
    [field] = (
        field_info for field_info in row.parameters[member].annotation.__metadata__ if field_info.description
    )
    return str(field.description)
