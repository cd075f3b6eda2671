"""The server's own certificate, made at the first start, and the folder of clients that it trusts."""

import logging
import os
import socket
from collections.abc import Iterator
from datetime import UTC, datetime, timedelta
from ipaddress import ip_address
from pathlib import Path
from typing import Final

from cryptography import x509
from cryptography.exceptions import InvalidSignature
from cryptography.hazmat.primitives import hashes, serialization
from cryptography.hazmat.primitives.asymmetric import rsa
from cryptography.x509.oid import ExtendedKeyUsageOID, NameOID

log = logging.getLogger(__name__)

CERTIFICATE: Final = "certificate.der"
KEY: Final = "key.pem"
KEY_BITS: Final = 2048
GOOD_FOR: Final = timedelta(days=5 * 365)
ENDS_SOON: Final = timedelta(days=30)
ENDINGS: Final = frozenset({".der", ".pem", ".crt", ".cer"})
MOST_REJECTED: Final = 20
"""Most certificates of refused clients that are kept, for an operator to inspect."""


class Untrusted(Exception):
    """A client's certificate is not in the folder of those that are trusted."""


def own_certificate(folder: Path, uri: str) -> tuple[Path, Path]:
    """Give the files of the server's certificate and of its key; they are made where there are none.

    :raises OSError: they cannot be written.
    :raises ValueError: what is there is no certificate.
    """
    certificate, key = folder / CERTIFICATE, folder / KEY
    if not (certificate.exists() and key.exists()):
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        _make(certificate, key, uri)
        log.info("made the server's certificate: %s", certificate)
    its = x509.load_der_x509_certificate(certificate.read_bytes())
    if uri not in _uris(its):
        raise ValueError(f"{certificate} is for another application_uri; remove it, and a new one is made")
    if its.not_valid_after_utc - datetime.now(UTC) < ENDS_SOON:
        log.warning("%s ends at %s; remove it, and a new one is made", certificate, its.not_valid_after_utc)
    return certificate, key


def _make(certificate: Path, key_file: Path, uri: str) -> None:
    key = rsa.generate_private_key(public_exponent=65537, key_size=KEY_BITS)
    with os.fdopen(os.open(key_file, os.O_WRONLY | os.O_CREAT | os.O_TRUNC, 0o600), "wb") as file:
        file.write(
            key.private_bytes(
                serialization.Encoding.PEM,
                serialization.PrivateFormat.PKCS8,
                serialization.NoEncryption(),
            )
        )
    name = x509.Name([x509.NameAttribute(NameOID.COMMON_NAME, "motion-gateway")])
    now = datetime.now(UTC)
    its = (
        x509.CertificateBuilder()
        .subject_name(name)
        .issuer_name(name)
        .public_key(key.public_key())
        .serial_number(x509.random_serial_number())
        .not_valid_before(now - timedelta(hours=1))
        .not_valid_after(now + GOOD_FOR)
        .add_extension(x509.BasicConstraints(ca=False, path_length=None), critical=True)
        .add_extension(_usage(), critical=True)
        .add_extension(x509.ExtendedKeyUsage([ExtendedKeyUsageOID.SERVER_AUTH]), critical=False)
        .add_extension(x509.SubjectKeyIdentifier.from_public_key(key.public_key()), critical=False)
        .add_extension(x509.AuthorityKeyIdentifier.from_issuer_public_key(key.public_key()), critical=False)
        .add_extension(
            x509.SubjectAlternativeName([x509.UniformResourceIdentifier(uri), *_own_names()]), critical=False
        )
        .sign(key, hashes.SHA256())
    )
    certificate.write_bytes(its.public_bytes(serialization.Encoding.DER))


def _usage() -> x509.KeyUsage:
    return x509.KeyUsage(
        digital_signature=True,
        content_commitment=True,
        key_encipherment=True,
        data_encipherment=True,
        key_agreement=False,
        key_cert_sign=True,  # it signs itself
        crl_sign=False,
        encipher_only=False,
        decipher_only=False,
    )


def _own_names() -> list[x509.GeneralName]:
    names = dict.fromkeys((socket.gethostname(), socket.getfqdn(), "localhost"))
    return [*(x509.DNSName(name) for name in names), x509.IPAddress(ip_address("127.0.0.1"))]


def _uris(certificate: x509.Certificate) -> list[str]:
    try:
        its = certificate.extensions.get_extension_for_class(x509.SubjectAlternativeName)
    except x509.ExtensionNotFound:
        return []
    return its.value.get_values_for_type(x509.UniformResourceIdentifier)


class Trusted:
    """The folder of trusted certificates: those of clients, or of the authorities that signed them.

    It is read anew for each client that connects: to trust one is to copy a file, to trust it no more is to
    remove one. Refused certificates are put into `rejected`, from where they can be copied.
    """

    def __init__(self, folder: Path, rejected: Path) -> None:
        self.folder, self._rejected = folder, rejected
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)

    def require(self, der: bytes) -> None:
        """Let a client pass whose certificate is trusted, and is good today.

        :raises Untrusted: it is not.
        """
        try:
            certificate = x509.load_der_x509_certificate(der)
        except ValueError:
            raise Untrusted("it is no certificate") from None
        if not certificate.not_valid_before_utc <= datetime.now(UTC) <= certificate.not_valid_after_utc:
            raise Untrusted("it is not good today")
        if not any(
            certificate == trusted or _signed(trusted, certificate) for trusted in self._certificates()
        ):
            raise Untrusted(self._reject(certificate))

    def _certificates(self) -> Iterator[x509.Certificate]:
        for path in sorted(self.folder.iterdir()):
            if path.suffix.lower() not in ENDINGS:
                continue
            try:
                content = path.read_bytes()
                pem = content.startswith(b"-----")
                yield (x509.load_pem_x509_certificate if pem else x509.load_der_x509_certificate)(content)
            except (OSError, ValueError) as error:
                log.warning("%s cannot be read: %s", path, error)

    def _reject(self, certificate: x509.Certificate) -> str:
        """Keep a refused certificate for the operator to inspect; gives the sentence for the log."""
        path = self._rejected / f"{certificate.fingerprint(hashes.SHA1()).hex()}.der"  # noqa: S303  # a name
        try:
            self._rejected.mkdir(mode=0o700, parents=True, exist_ok=True)
            if path.exists() or sum(1 for _ in self._rejected.iterdir()) < MOST_REJECTED:
                path.write_bytes(certificate.public_bytes(serialization.Encoding.DER))
        except OSError as error:
            log.warning("%s cannot be written: %s", path, error.strerror)
        who = certificate.subject.rfc4514_string()
        return f"{who} is not in {self.folder}; if you trust it: cp {path} {self.folder}"


def _signed(authority: x509.Certificate, certificate: x509.Certificate) -> bool:
    """Tell if a trusted authority has signed a certificate; a client's own certificate signs for none."""
    try:
        if not authority.extensions.get_extension_for_class(x509.BasicConstraints).value.ca:
            return False
        certificate.verify_directly_issued_by(authority)
    except (x509.ExtensionNotFound, ValueError, TypeError, InvalidSignature):
        return False
    return authority.not_valid_before_utc <= datetime.now(UTC) <= authority.not_valid_after_utc
