"""Requests to a gateway by Python's own HTTP: another library takes longer to load than a stop to be done."""

import codecs
import json as json_of
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from http.client import HTTPConnection, HTTPException, HTTPResponse, HTTPSConnection
from typing import Any, Final
from urllib.parse import SplitResult, quote, urlencode, urlsplit

UNAUTHORIZED, FORBIDDEN, CONFLICT, UNAVAILABLE = 401, 403, 409, 503
_PIECE: Final = 65_536
_WRITTEN: Final = "/%:?&=~,;@!$'()*+[]"
"""Characters of a path and its query that are sent as they are."""


class NotReached(OSError):
    """No server answers, or its certificate is not trusted: nothing was sent."""


class AnswerLost(OSError):
    """The request was sent, or a part of it, and no whole answer came."""


class HttpAnswer:
    """An answer; its content is read when it is asked for."""

    def __init__(self, response: HTTPResponse) -> None:
        self.status_code = response.status
        self._response = response
        self._content: bytes | None = None

    @property
    def is_success(self) -> bool:
        """True if the request was carried out or begun."""
        return 200 <= self.status_code < 300

    def read(self) -> bytes:
        """Read all of it.

        :raises AnswerLost: it breaks off.
        """
        if self._content is None:
            with _losing():
                self._content = self._response.read()
        return self._content

    def json(self) -> Any:
        """Read it as JSON.

        :raises ValueError: it is none.
        """
        return json_of.loads(self.read())

    def iter_text(self) -> Iterator[str]:
        """Give its text as it comes; errors as of `iter_bytes`."""
        decoder = codecs.getincrementaldecoder("utf-8")()
        return map(decoder.decode, self.iter_bytes())

    def iter_bytes(self) -> Iterator[bytes]:
        """Give its content as it comes.

        :raises AnswerLost: it breaks off, or nothing comes in time.
        """
        with _losing():
            while piece := self._response.read1(_PIECE):
                yield piece
            if self._response.length:
                raise AnswerLost("its end is missing")


def request(
    method: str, url: str, *, json: object, headers: Mapping[str, str], timeout: float, trust_env: bool
) -> HttpAnswer:
    """Ask for something; `timeout` in seconds is for each step, redirections are not followed.

    :raises NotReached: nothing was sent.
    :raises AnswerLost: it may have been carried out.
    """
    with stream(method, url, json=json, headers=headers, timeout=timeout, trust_env=trust_env) as answer:
        answer.read()
        return answer


@contextmanager
def stream(
    method: str,
    url: str,
    *,
    json: object = None,
    params: Mapping[str, str] | None = None,
    headers: Mapping[str, str],
    timeout: float,
    silence: float | None = None,
    trust_env: bool,
) -> Iterator[HttpAnswer]:
    """Ask for an answer that is read within the block; from then on nothing may come for `silence` seconds.

    Errors as of `request`.
    """
    parts = _parts_of(url)
    connection = _connected(parts, timeout, trust_env=trust_env)
    try:
        content = None if json is None else json_of.dumps(json).encode()
        sent = {**headers, "Accept": "*/*", "User-Agent": "motion-gateway"}
        if content is not None:
            sent["Content-Type"] = "application/json"
        with _losing():
            connection.request(method, _target(parts, params), content, sent)
            response = connection.getresponse()
            if silence is not None and connection.sock is not None:
                connection.sock.settimeout(silence)
        yield HttpAnswer(response)
    finally:
        connection.close()


def _parts_of(url: str) -> SplitResult:
    try:
        parts = urlsplit(url)
        if parts.scheme in ("http", "https") and parts.hostname and parts.port != 0:
            return parts
    except ValueError as error:
        raise NotReached(f"this is no address: {error}") from None
    raise NotReached("an address is http://HOST:PORT or https://HOST:PORT")


def _target(parts: SplitResult, params: Mapping[str, str] | None) -> str:
    query = "&".join(filter(None, (parts.query, urlencode(params or {}))))
    return quote(parts.path or "/", safe=_WRITTEN) + (f"?{quote(query, safe=_WRITTEN)}" if query else "")


def _connected(parts: SplitResult, timeout: float, *, trust_env: bool) -> HTTPConnection:
    """Open a connection, by the proxy of the environment where that is trusted.

    :raises NotReached: that failed.
    """
    kind = HTTPSConnection if parts.scheme == "https" else HTTPConnection
    connection = kind(parts.hostname or "", parts.port, timeout=timeout)
    try:
        proxy = _proxy_of(parts) if trust_env else None
        if proxy is not None:
            connection = kind(proxy.hostname or "", proxy.port, timeout=timeout)
            connection.set_tunnel(parts.hostname or "", parts.port, _credentials(proxy))
        connection.connect()
    except (OSError, HTTPException, ValueError) as error:
        connection.close()
        raise NotReached(getattr(error, "strerror", None) or str(error) or "no answer in time") from error
    return connection


def _proxy_of(parts: SplitResult) -> SplitResult | None:
    from urllib.request import getproxies, proxy_bypass  # only for what leaves the machine

    proxy = getproxies().get(parts.scheme)
    return None if proxy is None or proxy_bypass(parts.hostname or "") else urlsplit(proxy)


def _credentials(proxy: SplitResult) -> dict[str, str]:
    from base64 import b64encode

    if proxy.username is None:
        return {}
    told = b64encode(f"{proxy.username}:{proxy.password or ''}".encode()).decode()
    return {"Proxy-Authorization": f"Basic {told}"}


@contextmanager
def _losing() -> Iterator[None]:
    """Tell everything that goes wrong after the connection was made as a lost answer."""
    try:
        yield
    except (OSError, HTTPException) as error:
        raise AnswerLost(str(error) or type(error).__name__) from error
