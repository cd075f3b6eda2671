"""The head of a request as it comes: what is asked for, and whether that can be served at all."""

import asyncio
import re
from typing import Any, Final
from urllib.parse import unquote

import httptools

from api.front import certificates
from api.front.pending_requests import PendingRequest
from api.front.refusals import NOT_HTTP, Refused
from api.front.stop_paths import is_heartbeat, is_life_sign, is_stop

_VERSIONS: Final = ("1.1", "1.0")
_KEY: Final = re.compile(rb"[A-Za-z0-9+/]{22}==")


class ConnectionScope:
    """The common part of the scopes of a connection's requests, as ASGI has it."""

    def __init__(self, transport: asyncio.BaseTransport, root_path: str) -> None:
        self._common: dict[str, Any] = {
            "asgi": {"version": "3.0", "spec_version": "2.3"},
            "server": _address(transport.get_extra_info("sockname")),
            "client": _address(transport.get_extra_info("peername")),
            "root_path": root_path,
        }
        certificates.note(self._common, certificates.common_name(transport))
        self._root_path = root_path
        encrypted = transport.get_extra_info("sslcontext") is not None
        self._schemes = (
            {"http": "https", "websocket": "wss"} if encrypted else {"http": "http", "websocket": "ws"}
        )

    def of(self, kind: str, head: "RequestHead", version: str) -> dict[str, Any]:
        """Describe a request."""
        url = httptools.parse_url(head.url)
        path, root = url.path.decode("ascii"), self._root_path
        return {
            **self._common,
            "type": kind,
            "scheme": self._schemes[kind],
            "http_version": version,
            "path": root + (unquote(path) if "%" in path else path),
            "raw_path": root.encode("ascii") + url.path,
            "query_string": url.query or b"",
            "headers": head.lines,
            "state": {},
        }


class RequestHead:
    """One head, from its first byte until the next request begins."""

    __slots__ = (
        "expects_continue",
        "in_body",
        "is_life_sign",
        "is_stop",
        "is_urgent",
        "lines",
        "opens",
        "receiving",
        "request",
        "url",
    )

    def __init__(self) -> None:
        self.url = b""
        self.lines: list[tuple[bytes, bytes]] = []
        self.expects_continue = False
        self.receiving = True
        """True until the request is there as a whole."""
        self.in_body = False
        self.is_stop = self.is_life_sign = self.is_urgent = False
        self.opens: dict[str, Any] = {}
        """The scope of a WebSocket that is being opened."""
        self.request: PendingRequest | None = None
        """The request that was made of it, once it had come as a whole."""

    def take(self, name: bytes, value: bytes, most: int) -> None:
        """Take a header line.

        :raises Refused: there are more than `most`.
        """
        if len(self.lines) >= most:
            raise Refused(431, f"The request has more than {most} header lines.")
        name = name.lower()
        if name == b"expect" and value.lower() == b"100-continue":
            self.expects_continue = True
        self.lines.append((name, value))

    @property
    def path(self) -> bytes:
        """The target without its query."""
        return self.url.partition(b"?")[0]

    def again(self, parser: httptools.HttpRequestParser, but: bytes = b"") -> bytes:
        """Write it once more, without the headers of one name."""
        version = parser.get_http_version().encode()
        lines = [b"%b: %b" % line for line in self.lines if line[0] != but]
        return b"\r\n".join([parser.get_method() + b" " + self.url + b" HTTP/" + version, *lines, b"", b""])

    @property
    def opens_websocket(self) -> bool:
        """True if a request that offers another protocol offers this one."""
        headers = dict(self.lines)
        offered = [token.strip() for token in headers.get(b"connection", b"").lower().split(b",")]
        return b"upgrade" in offered and headers.get(b"upgrade", b"").lower() == b"websocket"

    def complete(self, method: str, version: str) -> None:
        """Find out what it asks for, and whether that may wait.

        :raises Refused: it is no HTTP/1.1, has another target than a path, or no Host.
        """
        path = self.path.decode("latin-1")
        asked = method, unquote(path) if "%" in path else path
        self.is_stop, self.is_life_sign = is_stop(*asked), is_life_sign(*asked)
        self.is_urgent = self.is_life_sign or is_heartbeat(*asked)
        if version not in _VERSIONS:
            raise Refused(400, NOT_HTTP)
        if method == "CONNECT":  # the parser would wait for another protocol for ever
            raise Refused(400, "CONNECT is for proxies, and the gateway is none.")
        if not path.startswith("/"):
            raise Refused(400, "The target of the request is not a path of this gateway, such as /bodies.")
        hosts = [name for name, _ in self.lines].count(b"host")
        if hosts > 1 or (hosts == 0 and version != "1.0"):
            raise Refused(400, f"The request has {hosts or 'no'} Host headers; it takes one.")

    def require_good_handshake(self, method: str, version: str, *, ahead: bool) -> None:
        """Refuse a WebSocket that cannot be opened (RFC 6455 4.2.1).

        :raises Refused: it was asked for `ahead` of an answer, or its handshake is not complete.
        """
        headers = dict(self.lines)
        if ahead:
            raise Refused(400, "A WebSocket was asked for ahead of the answer to another request.")
        if method != "GET" or version != "1.1":
            raise Refused(400, "A WebSocket is opened by GET with HTTP/1.1.")
        if headers.get(b"sec-websocket-version") != b"13":
            raise Refused(400, "A WebSocket is opened with the header Sec-WebSocket-Version: 13.")
        if not _KEY.fullmatch(headers.get(b"sec-websocket-key", b"")):
            raise Refused(400, "A WebSocket is opened with a Sec-WebSocket-Key of 16 bytes in base64.")


def _address(found: Any) -> tuple[str, int] | None:
    """Host and port of a socket's end; None where it has none."""
    return (str(found[0]), int(found[1])) if isinstance(found, tuple) else None
