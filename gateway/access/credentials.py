"""Credentials that let a caller in: a key, or a token of an OpenID provider."""

import time
from collections.abc import Callable
from typing import Final, Protocol

from gateway.access.grants import Grant
from gateway.access.keys import Key, KeyStore

KEY: Final = "mg_"
"""Prefix of every key."""


class TokenVerifier(Protocol):
    """Checks tokens that are no keys."""

    def verify(self, token: str) -> Grant | None:
        """Find the holder of a token; None if it is not good.

        :raises NotPermitted: it is good, and gives no role here.
        """


class Credentials:
    """All that is taken. Without a store no key is good, and without a verifier no token."""

    def __init__(
        self,
        keys: KeyStore | None = None,
        tokens: TokenVerifier | None = None,
        clock: Callable[[], float] = time.time,
    ) -> None:
        self.keys = keys
        self._tokens = tokens
        self._clock = clock
        self._known: dict[str, Grant] = {}

    def verify(self, shown: str) -> Grant | None:
        """Find out who shows this; None if it is not good now.

        :raises NotPermitted: a token is good, and gives no role here.
        """
        if not shown.startswith(KEY):
            return self._tokens.verify(shown) if self._tokens else None
        return self._grant_of(self.keys.verify(shown) if self.keys else None)

    def to_stop(self, prefix: str, digest: str) -> Grant | None:
        """Find the good key of a prefix and a hash; who shows no more than these may stop, and no more."""
        return self._grant_of(self.keys.verify_digest(prefix, digest) if self.keys else None)

    def certified(self, name: str) -> Grant | None:
        """Find the good key that a certificate names, with which its holder acts; None if there is none."""
        return self._grant_of(self.keys.good(name) if self.keys else None)

    def _grant_of(self, key: Key | None) -> Grant | None:
        if key is None:
            return None
        grant = self._known.get(key.prefix)
        if grant is None or grant.key is not key:
            grant = self._known[key.prefix] = Grant(key.principal(), key)
        return grant

    def knows(self, grant: Grant) -> bool:
        """Say whether a credential that was good a moment ago is still good, without reading the key file."""
        if grant.key is not None:
            return self.keys is not None and self.keys.knows(grant.key)
        return self.holds(grant)

    def holds(self, grant: Grant) -> bool:
        """Say whether a credential that was good before still is; reads the key file if it has changed."""
        if grant.key is not None:
            return self.keys is not None and self.keys.has(grant.key)
        return grant.expires is not None and self._clock() < grant.expires
