"""The addresses of transports, and the strict reading of their URLs."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from importlib import import_module
from urllib.parse import parse_qsl, unquote, urlsplit

from transports.base import Transport

# scheme -> module:class, imported when first used; the class takes an Address.
SCHEMES: dict[str, str] = {
    "serial": "transports.serial_port:SerialPort",
    "tcp": "transports.tcp:TcpPort",
    "dpram": "transports.dpram:DpramPort",
}

_NUMBER = re.compile("0x[0-9A-Fa-f]{1,8}|[0-9]{1,9}")


@dataclass(frozen=True, slots=True)
class Address:
    """A transport's URL in its parts; `text` is the URL as it was written."""

    text: str
    scheme: str
    host: str
    port: int | None
    path: str
    options: Mapping[str, str]

    @classmethod
    def parse(cls, text: str) -> "Address":
        """Read `scheme://host:port/path?option=value`.

        :raises ValueError: not such a URL, or its scheme is unknown.
        """
        if not text.isascii() or not text.isprintable() or " " in text:
            raise ValueError(f"address {text!r} has a blank, a control character or a non-ASCII character")
        try:
            url = urlsplit(text)
            host, port = url.hostname or "", url.port
        except ValueError as error:
            raise ValueError(f"address {text!r} is not a URL: {error}") from error
        if url.scheme not in SCHEMES or not text.startswith(f"{url.scheme}://"):
            known = ", ".join(f"{scheme}://" for scheme in SCHEMES)
            raise ValueError(f"address {text!r} must begin with one of {known}")
        if "@" in url.netloc or "#" in text:
            raise ValueError(f"address {text!r} must have neither a user name nor a fragment")
        path = unquote(url.path)
        if not path.isprintable():
            raise ValueError(f"address {text!r} has a control character in its path")
        return cls(text, url.scheme, host, port, path, _read_options(text, url.query))

    def expect_options(self, *known: str) -> None:
        """Refuse every option but these.

        :raises ValueError: the address has another one.
        """
        for name in self.options:
            if name not in known:
                allowed = ", ".join(known) or "none"
                raise ValueError(f"address {self.text!r} has the unknown option {name!r}; allowed: {allowed}")

    def integer(self, option: str, default: int, lowest: int, highest: int) -> int:
        """Read a whole number, decimal or as 0x400.

        :raises ValueError: it is something else, or out of range.
        """
        digits = self.options.get(option, str(default))
        value = int(digits, 16 if digits.startswith("0x") else 10) if _NUMBER.fullmatch(digits) else None
        if value is None or not lowest <= value <= highest:
            raise ValueError(
                f"address {self.text!r}: {option} must be a whole number "
                f"from {lowest} to {highest}, not {digits!r}"
            )
        return value

    def choice(self, option: str, allowed: Sequence[int]) -> int:
        """Read one of a few numbers; the first is the default.

        :raises ValueError: it is none of them.
        """
        digits = self.options.get(option, str(allowed[0]))
        known = [str(number) for number in allowed]
        if digits not in known:
            raise ValueError(
                f"address {self.text!r}: {option} must be one of {', '.join(known)}, not {digits!r}"
            )
        return int(digits)


def create(address: str) -> Transport:
    """Make the transport an address names; it is not opened yet.

    :raises ValueError: the address is not understood to its last character; one sentence says why.
    """
    parts = Address.parse(address)
    module, _, name = SCHEMES[parts.scheme].partition(":")
    transport: Transport = getattr(import_module(module), name)(parts)
    return transport


def _read_options(address: str, query: str) -> dict[str, str]:
    try:
        pairs = parse_qsl(query, keep_blank_values=True, strict_parsing=True) if query else []
    except ValueError as error:
        raise ValueError(f"address {address!r}: options are written ?name=value&name=value") from error
    options = dict(pairs)
    if len(options) < len(pairs):
        raise ValueError(f"address {address!r} gives an option twice")
    return options
