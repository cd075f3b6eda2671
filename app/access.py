"""The access of clients while the gateway runs: its keys, the provider's keys and the certificate."""

import asyncio
import logging
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Final

from app.tls import Certificate
from gateway.access.credentials import Credentials, TokenVerifier
from gateway.access.keys import KeyFault, KeyInfo, KeyStore
from gateway.config import Config
from gateway.core.toml_files import ConfigError
from gateway.door.opening import policy_of

log = logging.getLogger(__name__)

KEEP_USES_S: Final = 60.0
WATCH_KEYS_S: Final = 60.0


class AccessControl:
    """Lets in callers with a good credential; its tasks run from `start` to `stop`."""

    def __init__(self, config: Config, data: Path) -> None:
        """Read the keys and the certificate.

        :raises ConfigError: they cannot be used, or no client on the network could be let in.
        """
        server = config.server
        self.certificate: Certificate | None = None
        self.credentials: Credentials | None = None
        self._store = KeyStore(data)
        self.on_key: Callable[[str, KeyInfo], object] = lambda _what, _key: None
        """Called with `ends_soon` or `expired`, and the key."""
        self._states: dict[str, tuple[bool, str]] | None = None
        self._work = [self._keep_uses, self._watch_keys]
        self._tasks: list[asyncio.Task[None]] = []
        if server.tls_certificate and server.tls_key:
            self.certificate = Certificate(
                server.tls_certificate,
                server.tls_key,
                server.tls_client_ca,
                required=server.tls_client_required,
            )
            self._work.append(self.certificate.watch)
        if config.access.mode == "keys":
            self._adopt(config)
            self.credentials = Credentials(self._store, self._tokens(config))
            self._require_somebody(config, data)

    def start(self) -> None:
        """Begin to keep all of it fresh."""
        self._tasks = [asyncio.create_task(work(), name="access") for work in self._work]

    async def stop(self) -> None:
        """End that."""
        for task in self._tasks:
            task.cancel()
        await asyncio.gather(*self._tasks, return_exceptions=True)
        self._write_uses()

    def _tokens(self, config: Config) -> TokenVerifier | None:
        if config.access.oidc is None:
            return None
        try:
            from gateway.access.oidc import OidcVerifier
        except ImportError as error:
            raise ConfigError(
                "access.oidc needs PyJWT with its cryptography: pip install 'motion-gateway[oidc]'"
            ) from error
        verifier = OidcVerifier(config.access.oidc)
        self._work.append(verifier.run)
        return verifier

    def _require_somebody(self, config: Config, data: Path) -> None:
        try:
            self._store.all()
        except KeyFault as fault:
            raise ConfigError(str(fault)) from fault
        if not self._store.is_empty or config.access.oidc is not None:
            return
        sentence = f"There is no key yet: motion-gateway keys create NAME --role admin --data {data}"
        if not config.server.is_local or config.server.trusted_proxies:
            raise ConfigError(sentence)
        log.warning("%s. Until then nobody is let in.", sentence)

    def _adopt(self, config: Config) -> None:
        try:
            self._store.adopt(policy_of(config))
        except KeyFault as fault:
            if config.access.four_eyes:
                raise ConfigError(str(fault)) from fault
            log.warning("%s", fault)

    async def _watch_keys(self) -> None:
        """Tell of keys that end soon, and of those that have ended."""
        while True:
            try:
                self._tell_changes(await asyncio.to_thread(self._store.infos))
            except KeyFault as fault:
                log.warning("it cannot be seen which keys end soon: %s", fault)
            await asyncio.sleep(WATCH_KEYS_S)

    def _tell_changes(self, keys: Sequence[KeyInfo]) -> None:
        """At the first look what has ended before is no news."""
        before = self._states
        self._states = {key.begins: (key.ends_soon, key.state) for key in keys}
        for key in keys:
            soon, state = (before or {}).get(key.begins, (False, key.state))
            if key.ends_soon and not soon:
                log.warning("the key %s ends at %s; keys rotate makes a new one", key.name, key.expires_at)
                self.on_key("ends_soon", key)
            if key.state == "expired" and state != "expired":
                log.warning("the key %s has ended", key.name)
                self.on_key("expired", key)

    async def _keep_uses(self) -> None:
        while True:
            await asyncio.sleep(KEEP_USES_S)
            await asyncio.to_thread(self._write_uses)

    def _write_uses(self) -> None:
        try:
            self._store.keep_uses()
        except OSError as error:
            log.warning("when keys were last used cannot be written down: %s", error)
