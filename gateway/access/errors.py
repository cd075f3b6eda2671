"""Refusals of access control."""

from gateway.core.errors import GatewayError, NotSent


class NotAuthenticated(GatewayError):
    """The caller is not known."""

    kind = "not-authenticated"


class NothingShown(NotAuthenticated):
    """The request shows no credential, as at a first visit, or a session that is over."""


class CookieAlone(NotAuthenticated):
    """A session's cookie is shown without its second secret: perhaps by who has seen it at another port."""


class NotPermitted(GatewayError):
    """The caller does not have the right, or not on this body, group, line or robot."""

    kind = "not-permitted"


class LimitReached(NotSent):
    """A key has as many requests, subscribers or moves as it may have."""

    kind = "limit-reached"
