"""Why somebody is refused."""

from gateway.core.errors import GatewayError, NotSent


class NotAuthenticated(GatewayError):
    """The caller is not known."""

    kind = "not-authenticated"
    title = "A valid key is needed"
    title_ja = "有効なキーが必要です"


class NothingShown(NotAuthenticated):
    """No credential is shown, or a session that is over: somebody comes for the first time, or comes late."""


class NotPermitted(GatewayError):
    """The caller does not have the right, or not on this body, group, line or robot."""

    kind = "not-permitted"
    title = "The key does not allow it"
    title_ja = "このキーでは許可されていません"


class LimitReached(NotSent):
    """A key has as many requests, subscribers or moves as it may have."""

    kind = "limit-reached"
    title = "The key is at its limit"
    title_ja = "キーの上限に達しています"
