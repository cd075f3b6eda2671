"""The one hook at which access control refuses a request, before anything but its head is read."""

from starlette.types import Scope

from gateway.core.rights import Right


class Access:
    """Lets everything pass: there is no access control yet."""

    def require(self, scope: Scope, right: Right) -> None:
        """Refuse a request or a WebSocket whose sender does not have the right; `scope` is as in ASGI.

        :raises GatewayError: the sender does not have it; nothing was done.
        """
