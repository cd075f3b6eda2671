"""The gateway's certificate, which is taken anew when its files are."""

import asyncio
import logging
import ssl
from hashlib import sha256
from pathlib import Path
from typing import Final

from gateway.core.toml_files import ConfigError

log = logging.getLogger(__name__)

RECHECK_S: Final = 5.0
CIPHERS: Final = "ECDHE+AESGCM:ECDHE+CHACHA20"
"""Cipher suites of TLS 1.2: forward secrecy and authenticated encryption, no CBC; 1.3 has nothing else."""


class Certificate:
    """A certificate and its key, for TLS 1.2 and newer."""

    def __init__(
        self, certificate: Path, key: Path, client_ca: Path | None = None, *, required: bool = False
    ) -> None:
        """Read them; certificates of clients that `client_ca` has signed are taken, or `required`.

        :raises ConfigError: one cannot be read, or they do not belong together.
        """
        self._files = certificate, key
        self.context = _context()
        if client_ca is not None:
            self.context.verify_mode = ssl.CERT_REQUIRED if required else ssl.CERT_OPTIONAL
            self._trust(client_ca)
        self._seen = self._stamp()
        try:
            self._load()
        except OSError as error:  # ssl.SSLError is one
            raise ConfigError(
                f"server.tls_certificate {certificate} and server.tls_key {key} cannot be used: "
                f"{error.strerror or error}"
            ) from error

    def fingerprint(self) -> str:
        """The SHA-256 of the certificate, as browsers show it."""
        digest = sha256(ssl.PEM_cert_to_DER_cert(_first_certificate(self._files[0].read_text("ascii"))))
        return digest.digest().hex(":").upper()

    async def watch(self) -> None:
        """Look at the files from time to time until it is cancelled."""
        while True:
            await asyncio.sleep(RECHECK_S)
            self.check()

    def check(self) -> None:
        """Take the files anew if they are others; what cannot be used leaves those before in force."""
        stamp = self._stamp()
        if stamp == self._seen or stamp is None:
            return
        self._seen = stamp
        try:
            self._load()
        except OSError as error:
            log.warning("the renewed certificate cannot be used, the one before stays in force: %s", error)
        else:
            log.info("the renewed certificate is in force")

    def _trust(self, client_ca: Path) -> None:
        try:
            self.context.load_verify_locations(client_ca)
        except OSError as error:
            raise ConfigError(
                f"server.tls_client_ca {client_ca} cannot be used: {error.strerror or error}"
            ) from error

    def _load(self) -> None:
        # A context that refuses a key has taken the certificate already: so they are tried in another one.
        for context in (_context(), self.context):
            context.load_cert_chain(*self._files, password=_no_passphrase)

    def _stamp(self) -> list[tuple[int, int, int]] | None:
        try:
            found = [file.stat() for file in self._files]
        except OSError:
            return None
        return [(status.st_mtime_ns, status.st_ino, status.st_size) for status in found]


def _first_certificate(pem: str) -> str:
    end = "-----END CERTIFICATE-----"
    return pem[pem.index("-----BEGIN CERTIFICATE-----") : pem.index(end) + len(end)]


def _no_passphrase() -> str:
    """Refuse a passphrase: OpenSSL would ask at the terminal, and the whole gateway would wait for it."""
    raise OSError("the key has a passphrase, for which nobody is asked; keep it without one, mode 600")


def _context() -> ssl.SSLContext:
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
    context.minimum_version = ssl.TLSVersion.TLSv1_2
    context.set_ciphers(CIPHERS)
    return context
