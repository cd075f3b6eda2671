"""Tokens of an OpenID provider, of which there is one in this test: no network is used."""

import asyncio
from collections.abc import Mapping
from typing import Any, Final

import pytest

jwt = pytest.importorskip("jwt", reason="the extra `oidc` is not installed")
from cryptography.hazmat.primitives.asymmetric import ec, rsa  # noqa: E402

from gateway.access.credentials import Credentials  # noqa: E402
from gateway.access.errors import NotPermitted  # noqa: E402
from gateway.access.grants import Grant  # noqa: E402
from gateway.access.oidc import LEEWAY_S, OidcVerifier  # noqa: E402
from gateway.access.roles import Role  # noqa: E402
from gateway.config import Oidc  # noqa: E402

ISSUER: Final = "https://id.plant/realms/x"
NOW: Final = 4_000_000_000
"""PyJWT has a clock of its own, before this."""
CLAIMS: Final[Mapping[str, Any]] = {
    "iss": ISSUER,
    "aud": "motion-gateway",
    "sub": "u1",
    "name": "Hanako",
    "iat": 1_000_000_000,
    "exp": NOW,
    "realm": {"roles": ["mg-view", "mg-move", "other"]},
    "places": "line1 r1",
}
SETTINGS: Final = {
    "issuer": ISSUER,
    "audience": "motion-gateway",
    "roles": {"mg-view": "viewer", "mg-move": "operator"},
    "role_claim": "realm.roles",
    "name_claim": "name",
    "scope_claim": "places",
}
RSA: Final = rsa.generate_private_key(65_537, 2048)
OTHER: Final = rsa.generate_private_key(65_537, 2048)
EC: Final = ec.generate_private_key(ec.SECP256R1())


def jwk(key: Any, kid: str) -> dict[str, Any]:
    algorithm = (
        jwt.algorithms.RSAAlgorithm if isinstance(key, rsa.RSAPrivateKey) else jwt.algorithms.ECAlgorithm
    )
    return {**algorithm.to_jwk(key.public_key(), as_dict=True), "kid": kid, "use": "sig"}


class Provider:
    """Publishes keys, and counts how often it was asked."""

    def __init__(self) -> None:
        self.keys = [jwk(RSA, "a"), jwk(EC, "e")]
        self.about = {"issuer": ISSUER, "jwks_uri": f"{ISSUER}/keys"}
        self.asked: list[str] = []

    async def __call__(self, url: str) -> Mapping[str, Any]:
        self.asked.append(url)
        return {"keys": self.keys} if url == f"{ISSUER}/keys" else self.about


def token(key: Any = RSA, kid: str | None = "a", algorithm: str = "RS256", **claims: Any) -> str:
    content = {name: value for name, value in {**CLAIMS, **claims}.items() if value is not None}
    headers = {} if kid is None else {"kid": kid}
    return str(jwt.encode(content, key, algorithm, headers=headers))


@pytest.fixture
def provider() -> Provider:
    return Provider()


@pytest.fixture
def verifier(provider: Provider) -> OidcVerifier:
    verifier = OidcVerifier(Oidc.model_validate(SETTINGS), provider, lambda: 2_000_000_000)
    assert asyncio.run(verifier._fetched())
    return verifier


def good(verifier: OidcVerifier, shown: str) -> Grant:
    grant = verifier.verify(shown)
    assert grant is not None
    return grant


def test_a_token_says_who_somebody_is_and_where(verifier: OidcVerifier) -> None:
    for shown in (token(), token(EC, "e", "ES256")):
        principal = good(verifier, shown).principal
        assert (principal.name, principal.role) == ("oidc:u1 (Hanako)", Role.OPERATOR)
        assert principal.scope == frozenset({"line1", "r1"})
        assert principal.id == "oidc u1"
    assert good(verifier, token()) is good(verifier, token())
    assert Credentials(None, verifier).verify(token()) is not None
    assert Credentials().verify(token()) is None


@pytest.mark.parametrize(
    ("subject", "name", "written"),
    [
        ("u1", "admin", "oidc:u1 (admin)"),
        ("admin", None, "oidc:admin"),
        ("admin", "admin", "oidc:admin"),
        ("u 1\x1b", "a\nb", "oidc:u?1? (a?b)"),
        ("u" * 300, "n" * 300, f"oidc:{'u' * 255} ({'n' * 64})"),
    ],
)
def test_nobody_is_taken_for_a_key_by_a_name_and_the_subject_is_told(
    verifier: OidcVerifier, subject: str, name: str | None, written: str
) -> None:
    principal = good(verifier, token(sub=subject, name=name)).principal
    assert principal.name == written
    assert principal.id == f"oidc {subject}"


@pytest.mark.parametrize(
    "shown",
    [
        token(OTHER),
        token(kid="b"),
        token(kid=None),
        token(EC, "a", "ES256"),
        token(algorithm="RS512"),
        token("secret" * 10, algorithm="HS256"),
        token(None, algorithm="none"),
        token(aud="another"),
        token(aud=None),
        token(iss="https://evil.example"),
        token(iss=None),
        token(exp=1_000_000_001),
        token(exp=None),
        token(sub=None),
        token(nbf=NOW - 1),
        token(iat=NOW - 1),
        token()[:-4] + "AAAA",
        token().replace(".", "", 1),
        "",
        "a.b.c",
        "\xff.\xff.\xff",
        "x" * 20_000,
    ],
)
def test_a_token_that_is_not_good_is_none(verifier: OidcVerifier, shown: str) -> None:
    assert verifier.verify(shown) is None


def test_a_token_without_a_role_here_is_refused(verifier: OidcVerifier) -> None:
    for roles in (["other"], [], None, {"mg-view": 1}, 5):
        with pytest.raises(NotPermitted, match="no role"):
            verifier.verify(token(realm={"roles": roles}))


def test_a_token_without_the_claim_of_its_scope_is_for_nothing(verifier: OidcVerifier) -> None:
    assert good(verifier, token(places=None)).principal.scope == frozenset()


def test_a_token_that_was_good_ends(provider: Provider) -> None:
    now = [2_000_000_000.0]
    verifier = OidcVerifier(Oidc.model_validate(SETTINGS), provider, lambda: now[0])
    asyncio.run(verifier._fetched())
    credentials = Credentials(None, verifier, lambda: now[0])
    grant = good(verifier, token())
    assert credentials.holds(grant)
    now[0] = NOW + LEEWAY_S
    assert verifier.verify(token()) is None
    assert not credentials.holds(grant)


def test_a_key_that_the_provider_has_withdrawn_is_good_no_more(
    verifier: OidcVerifier, provider: Provider
) -> None:
    good(verifier, token())
    provider.keys = [jwk(OTHER, "b")]
    assert asyncio.run(verifier._fetched())
    assert verifier.verify(token()) is None
    good(verifier, token(OTHER, "b"))


@pytest.mark.parametrize(
    "about",
    [
        {"issuer": "https://evil.example", "jwks_uri": f"{ISSUER}/keys"},
        {"issuer": ISSUER},
        {"issuer": ISSUER, "jwks_uri": "http://id.plant/keys"},
    ],
)
def test_a_provider_that_says_something_else_is_not_believed(
    verifier: OidcVerifier, provider: Provider, about: dict[str, str]
) -> None:
    provider.about, provider.keys = about, [jwk(OTHER, "b")]
    assert not asyncio.run(verifier._fetched())
    good(verifier, token())


def test_a_key_that_is_not_known_is_fetched_in_the_background(provider: Provider) -> None:
    from tests.virtual_time import run_virtual

    async def story() -> None:
        verifier = OidcVerifier(Oidc.model_validate(SETTINGS), provider, lambda: 2_000_000_000)
        keeping = asyncio.create_task(verifier.run())
        await asyncio.sleep(1)
        good(verifier, token())
        provider.keys.append(jwk(OTHER, "b"))
        for _ in range(20):
            verifier.verify(token(OTHER, "b"))
        await asyncio.sleep(60)
        good(verifier, token(OTHER, "b"))
        assert len(provider.asked) == 4
        keeping.cancel()
        await asyncio.gather(keeping, return_exceptions=True)

    run_virtual(story())
