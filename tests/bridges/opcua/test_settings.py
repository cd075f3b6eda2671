"""The table `[opcua]`, and the certificates beside it."""

import stat
from pathlib import Path
from typing import Any

import pytest
from cryptography import x509
from cryptography.hazmat.primitives import serialization
from pydantic import ValidationError

from bridges.opcua.certificates import KEY, MOST_REJECTED, Trusted, Untrusted, own_certificate
from bridges.opcua.sessions import language_of
from bridges.opcua.settings import URI, OpcuaFile
from bridges.opcua.units import engineering_unit, scale_of
from tests.bridges.opcua.stand import make_certificate

GATEWAY = {"url": "http://127.0.0.1:8420"}


def file_of(**opcua: Any) -> OpcuaFile:
    return OpcuaFile.model_validate({"gateway": GATEWAY, "opcua": opcua})


@pytest.mark.parametrize(
    ("listen", "place"),
    [
        ("127.0.0.1:4840", ("127.0.0.1", 4840)),
        ("opc.tcp://0.0.0.0:4841/", ("0.0.0.0", 4841)),  # noqa: S104
        ("[::1]:0", ("::1", 0)),
    ],
)
def test_where_it_listens(listen: str, place: tuple[str, int]) -> None:
    assert file_of(listen=listen).place == place


@pytest.mark.parametrize(
    "wrong",
    [{"listen": "4840"}, {"listen": "a:99999"}, {"application_uri": "x y"}, {"good_for_s": 0}, {"x": 1}],
)
def test_what_cannot_be_meant_is_refused(wrong: dict[str, Any]) -> None:
    with pytest.raises(ValidationError):
        file_of(**wrong)


def test_the_servers_certificate_is_made_once_and_its_key_is_nobody_elses(tmp_path: Path) -> None:
    certificate, key = own_certificate(tmp_path / "opcua", URI)
    first = certificate.read_bytes()
    assert own_certificate(tmp_path / "opcua", URI) == (certificate, key)
    assert certificate.read_bytes() == first
    assert stat.S_IMODE((tmp_path / "opcua" / KEY).stat().st_mode) == 0o600
    with pytest.raises(ValueError, match="another application_uri"):
        own_certificate(tmp_path / "opcua", "urn:other")


def test_who_is_trusted_is_read_anew_and_who_is_not_is_kept(tmp_path: Path) -> None:
    trusted = Trusted(tmp_path / "trusted", tmp_path / "rejected")
    pem, _ = make_certificate(tmp_path)
    der = x509.load_pem_x509_certificate(pem.read_bytes()).public_bytes(serialization.Encoding.DER)
    with pytest.raises(Untrusted, match="cp "):
        trusted.require(der)
    with pytest.raises(Untrusted, match="no certificate"):
        trusted.require(b"x")
    kept = list((tmp_path / "rejected").iterdir())
    assert [it.read_bytes() for it in kept] == [der]
    (tmp_path / "trusted" / "client.pem").write_bytes(pem.read_bytes())
    trusted.require(der)
    (tmp_path / "trusted" / "client.pem").unlink()
    with pytest.raises(Untrusted):
        trusted.require(der)


def test_refused_certificates_do_not_fill_the_disk(tmp_path: Path) -> None:
    rejected = tmp_path / "rejected"
    rejected.mkdir()
    for number in range(MOST_REJECTED):
        (rejected / f"{number}.der").write_bytes(b"")
    pem, _ = make_certificate(tmp_path)
    der = x509.load_pem_x509_certificate(pem.read_bytes()).public_bytes(serialization.Encoding.DER)
    with pytest.raises(Untrusted):
        Trusted(tmp_path / "trusted", rejected).require(der)
    assert len(list(rejected.iterdir())) == MOST_REJECTED


@pytest.mark.parametrize(
    ("locales", "language"),
    [((), "en"), (("ja-JP",), "ja"), (("de", "ja"), "ja"), (("en-US", "ja"), "en"), ((None, "fr"), "en")],
)
def test_the_language_of_a_session(locales: tuple[str | None, ...], language: str) -> None:
    assert language_of(locales) == language


def test_units_have_their_codes_and_bodies_without_a_scale_count_pulses() -> None:
    assert engineering_unit("mm").UnitId == 5_066_068  # MMT, as the OPC Foundation's table has it
    assert engineering_unit("deg").UnitId == 17_476
    assert engineering_unit("pulse").UnitId == -1
    assert scale_of({"unit": "mm", "pulses_per_unit": 100.0}) == ("mm", 100.0)
    assert scale_of({"unit": None, "pulses_per_unit": None}) == ("pulse", 1.0)
