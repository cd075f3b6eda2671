"""The certificate: read, renewed, and kept where its renewal is no good."""

import asyncio
import logging
import ssl
from pathlib import Path

import pytest

from app.server import _uvicorn_config
from app.tls import Certificate
from gateway.config import Server
from gateway.core.toml_files import ConfigError
from tests.certificates import write_certificate, x509


def served(certificate: Certificate) -> str:
    """The name in the certificate that a new client is shown."""
    shown: list[bytes] = []

    async def story() -> None:
        server = await asyncio.start_server(
            lambda _, writer: writer.close(), "127.0.0.1", 0, ssl=certificate.context
        )
        trusting = ssl.create_default_context()
        trusting.check_hostname, trusting.verify_mode = False, ssl.CERT_NONE
        async with server:
            _, writer = await asyncio.open_connection(*server.sockets[0].getsockname(), ssl=trusting)
            shown.append(writer.get_extra_info("ssl_object").getpeercert(binary_form=True))
            writer.close()

    asyncio.run(story())
    return str(x509.load_der_x509_certificate(shown[0]).subject.rfc4514_string())


def test_a_renewed_certificate_is_shown_to_new_clients(tmp_path: Path) -> None:
    certificate = Certificate(*write_certificate(tmp_path, "first"))
    assert served(certificate) == "CN=first"
    write_certificate(tmp_path, "second")
    certificate.check()
    assert served(certificate) == "CN=second"


def test_a_renewal_that_is_no_good_changes_nothing(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    file, key = write_certificate(tmp_path, "first")
    certificate = Certificate(file, key)
    old_key = key.read_bytes()
    write_certificate(tmp_path, "half")
    key.write_bytes(old_key)  # does not belong to it
    with caplog.at_level(logging.WARNING):
        certificate.check()
        certificate.check()
    assert caplog.text.count("stays in force") == 1
    assert served(certificate) == "CN=first"
    key.unlink()
    certificate.check()
    assert served(certificate) == "CN=first"
    write_certificate(tmp_path, "whole")
    certificate.check()
    assert served(certificate) == "CN=whole"


def test_nothing_is_served_without_a_good_certificate(tmp_path: Path) -> None:
    file, key = write_certificate(tmp_path, "first")
    for wrong in ((file, tmp_path / "nowhere"), (key, key), (tmp_path, key)):
        with pytest.raises(ConfigError, match="cannot be used"):
            Certificate(*wrong)


def test_nobody_is_asked_for_a_passphrase(tmp_path: Path) -> None:
    file, key = write_certificate(tmp_path, "first")
    from cryptography.hazmat.primitives import serialization

    secret = serialization.load_pem_private_key(key.read_bytes(), None)
    locked = serialization.BestAvailableEncryption(b"secret")
    form = (serialization.Encoding.PEM, serialization.PrivateFormat.PKCS8)
    key.write_bytes(secret.private_bytes(*form, locked))
    with pytest.raises(ConfigError, match="has a passphrase"):
        Certificate(file, key)


def test_nothing_is_encrypted_with_cbc(tmp_path: Path) -> None:
    ciphers = [
        cipher["name"] for cipher in Certificate(*write_certificate(tmp_path, "first")).context.get_ciphers()
    ]
    assert ciphers
    assert [cipher for cipher in ciphers if "GCM" not in cipher and "CHACHA20" not in cipher] == []


def test_browsers_that_were_here_over_tls_do_not_come_in_plain_text(tmp_path: Path) -> None:
    certificate = Certificate(*write_certificate(tmp_path, "first"))
    name = "Strict-Transport-Security"
    assert (name, "max-age=31536000") in _uvicorn_config(None, Server(), certificate).headers
    assert name not in dict(_uvicorn_config(None, Server(), None).headers)


def test_old_versions_are_not_spoken(tmp_path: Path) -> None:
    context = Certificate(*write_certificate(tmp_path, "first")).context
    assert context.minimum_version is ssl.TLSVersion.TLSv1_2
