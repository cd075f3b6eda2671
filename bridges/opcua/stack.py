"""The library's server with a plant's additions: trust, keys, languages, and calls that do not wait.

It corrects asyncua 2.1: only a trusted certificate opens a channel, session names cannot be guessed, a
session stays with its owner if another channel asks for it in vain, a subscription belongs to the session
that made it, a slow call delays no other, and lost notifications are reported as lost.
"""

import asyncio
import logging
import secrets
import sys
from collections.abc import Awaitable, Callable, Iterable
from contextlib import suppress
from typing import Any, Final

import asyncua.server
from asyncua import Server, ua
from asyncua.common.utils import ServiceError
from asyncua.crypto.permission_rules import User, UserRole
from asyncua.crypto.validator import CertificateValidator, CertificateValidatorOptions
from asyncua.server.binary_server_asyncio import BinaryServer, OPCUAProtocol
from asyncua.server.internal_server import InternalServer
from asyncua.server.internal_session import InternalSession
from asyncua.server.monitored_item_service import WhereClauseEvaluator
from asyncua.server.subscription_service import SubscriptionService
from asyncua.server.uaprocessor import UaProcessor
from asyncua.server.user_managers import UserManager
from asyncua.ua.ua_binary import nodeid_from_binary, struct_from_binary, uatcp_to_binary

from bridges.opcua.certificates import Trusted, Untrusted
from bridges.opcua.sessions import GUEST, GatewayAway, Guest, SignInRefused

log = logging.getLogger(__name__)

POLICIES: Final = (
    ua.SecurityPolicyType.Basic256Sha256_SignAndEncrypt,
    ua.SecurityPolicyType.Aes256Sha256RsaPss_SignAndEncrypt,
)
MOST_MESSAGE_BYTES: Final = 4 << 20
MOST_CALLS: Final = 128
"""Calls under way on a connection."""
MOST_CONNECTIONS: Final = 100
MOST_SUBSCRIPTIONS: Final = 200
SHORTEST_PUBLISHING_MS: Final = 50.0


class _NoFaults(logging.Filter):
    """Keeps the library from telling of each refusal as of an error of its own."""

    def filter(self, record: logging.LogRecord) -> bool:
        return "service fault" not in record.msg


def quiet_library() -> None:
    """Let the library log errors alone: otherwise it tells of each node and each request."""
    logging.getLogger("asyncua").setLevel(logging.ERROR)
    logging.getLogger("asyncua.server.uaprocessor").addFilter(_NoFaults())
    logging.getLogger("asyncua.common.xmlparser").setLevel(logging.CRITICAL)
    logging.getLogger("asyncua.common.xmlimporter").setLevel(logging.CRITICAL)


def forget_sources() -> None:
    """Free the code that made the standard nodes: 8 MiB that never run again."""
    for name in [
        module for module in sys.modules if module.startswith("asyncua.server.standard_address_space")
    ]:
        del sys.modules[name]
    vars(asyncua.server).pop("standard_address_space", None)


def _request(name: str) -> ua.NodeId:
    return ua.NodeId(getattr(ua.ObjectIds, f"{name}Request_Encoding_DefaultBinary"))


CREATE_SESSION: Final = _request("CreateSession")
ACTIVATE_SESSION: Final = _request("ActivateSession")
CALL: Final = _request("Call")
DISCOVERY: Final = frozenset(map(_request, ("GetEndpoints", "FindServers", "CloseSecureChannel")))
"""Requests that are answered without encryption."""
REFUSED: Final = frozenset(map(_request, ("RegisterServer", "RegisterServer2")))

SignIn = Callable[[str | None, str | None, Iterable[str]], Awaitable[Guest]]
Refresh = Callable[[list[ua.NodeId], float], Awaitable[None]]
AddressOf = Callable[[ua.NodeId], str | None]


class Session(InternalSession):
    """A session of a guest."""

    iserver: "PlantServer"

    def __init__(self, *arguments: Any, **named: Any) -> None:
        super().__init__(*arguments, **named)
        self.guest: Guest | None = None
        self.certificate: bytes | None = None
        self._admitted: Guest | None = None
        # The library counts them: whoever guesses one would have the session.
        self.iserver.unregister_external_session(self)
        self.auth_token = ua.NodeId(secrets.token_bytes(32), 0, ua.NodeIdType.ByteString)
        self.iserver.register_external_session(self)

    async def admit(self, params: ua.ActivateSessionParameters) -> None:
        """Ask the gateway for the caller whose name and key activate the session.

        :raises ServiceError: the caller is not known, the key is wrong, or the gateway is away.
        """
        token = params.UserIdentityToken
        if not isinstance(token, ua.UserNameIdentityToken):
            raise ServiceError(ua.StatusCodes.BadIdentityTokenRejected)
        try:
            name, key = self.iserver.decrypt_user_token(self, token)
        except Exception:  # whatever a client has sent as a password
            raise ServiceError(ua.StatusCodes.BadIdentityTokenInvalid) from None
        await self._forget_admitted()
        try:
            self._admitted = await self.iserver.sign_in(name, key, params.LocaleIds or ())
        except SignInRefused as error:
            log.warning("%s is not let in: %s", self.name, error)
            raise ServiceError(ua.StatusCodes.BadUserAccessDenied) from None
        except GatewayAway as error:
            log.warning("%s is not let in: the gateway does not answer: %s", self.name, error)
            raise ServiceError(ua.StatusCodes.BadCommunicationError) from None

    def activate_session(
        self, params: ua.ActivateSessionParameters, peer_certificate: bytes | None
    ) -> ua.ActivateSessionResult:
        """Make the one who was admitted its guest."""
        if self._admitted is None:
            raise ServiceError(ua.StatusCodes.BadUserAccessDenied)
        result = super().activate_session(params, peer_certificate)
        before, self.guest, self._admitted = self.guest, self._admitted, None
        if before is not None:
            if before.name == self.guest.name:
                self.guest.leases = before.leases
            self.iserver.soon(before.caller.aclose())
        return result

    async def close_session(self, delete_subs: bool = True) -> None:
        """Forget the guest and its key; its leases run out by themselves."""
        await super().close_session(delete_subs)
        await self._forget_admitted()
        if self.guest is not None:
            await self.guest.caller.aclose()

    async def _forget_admitted(self) -> None:
        before, self._admitted = self._admitted, None
        if before is not None:
            await before.caller.aclose()

    def _sees(self, node: ua.NodeId) -> bool:
        return self.guest is not None and self.guest.sees(self.iserver.address_of(node))

    async def read(self, params: ua.ReadParameters) -> list[ua.DataValue]:
        """Read what the guest may see, anew where it asks for newer values than there are."""
        nodes = [
            wanted.NodeId for wanted in params.NodesToRead if wanted.AttributeId == ua.AttributeIds.Value
        ]
        await self.iserver.refresh([node for node in nodes if self._sees(node)], params.MaxAge / 1e3)
        values = await super().read(params)
        return [
            value if self._sees(wanted.NodeId) else _refused_value()
            for wanted, value in zip(params.NodesToRead, values, strict=True)
        ]

    async def write(self, params: ua.WriteParameters) -> list[ua.StatusCode]:
        """Refuse it: to write a variable never moves anything."""
        return [ua.StatusCode(ua.StatusCodes.BadNotWritable) for _ in params.NodesToWrite]

    async def browse(self, params: ua.BrowseParameters) -> list[ua.BrowseResult]:
        """List what the guest may see."""
        results = await super().browse(params)
        for result in results:
            result.References = [reference for reference in result.References if self._sees(reference.NodeId)]
        return results

    async def call(self, params: list[ua.CallMethodRequest]) -> list[ua.CallMethodResult]:
        """Call methods in the guest's name."""
        token = GUEST.set(self.guest)
        try:
            return await super().call(params)
        finally:
            GUEST.reset(token)

    async def create_subscription(self, params: Any, callback: Any, request_callback: Any = None) -> Any:
        """Make a subscription that is the guest's alone."""
        params.RequestedPublishingInterval = max(params.RequestedPublishingInterval, SHORTEST_PUBLISHING_MS)
        return await super().create_subscription(params, callback, request_callback)

    async def create_monitored_items(
        self, params: ua.CreateMonitoredItemsParameters
    ) -> list[ua.MonitoredItemCreateResult]:
        """Monitor what the guest may see."""
        self._own(params.SubscriptionId)
        hidden = [not self._sees(item.ItemToMonitor.NodeId) for item in params.ItemsToCreate]
        if any(hidden):
            params.ItemsToCreate = [
                item for item, is_hidden in zip(params.ItemsToCreate, hidden, strict=True) if not is_hidden
            ]
        made = iter(await super().create_monitored_items(params))
        self.iserver.judge_fully(params.SubscriptionId)
        return [_refused_item() if is_hidden else next(made) for is_hidden in hidden]

    async def modify_monitored_items(self, params: Any) -> Any:
        """Modify items of a subscription of the guest's own."""
        self._own(params.SubscriptionId)
        return await super().modify_monitored_items(params)

    async def delete_monitored_items(self, params: Any) -> Any:
        """Delete items of a subscription of the guest's own."""
        self._own(params.SubscriptionId)
        return await super().delete_monitored_items(params)

    async def set_monitoring_mode(self, params: Any) -> Any:
        """Set the mode of items of a subscription of the guest's own."""
        self._own(params.SubscriptionId)
        return await super().set_monitoring_mode(params)

    def modify_subscription(self, params: Any) -> Any:
        """Modify a subscription of the guest's own."""
        self._own(params.SubscriptionId)
        return super().modify_subscription(params)

    def republish(self, params: ua.RepublishParameters) -> ua.NotificationMessage:
        """Send a notification again.

        :raises ServiceError: it is there no more.
        """
        sub = self._own(params.SubscriptionId)
        message = sub.republish(params.RetransmitSequenceNumber)
        if not message.NotificationData:
            raise ServiceError(ua.StatusCodes.BadMessageNotAvailable)
        return message

    async def transfer_subscriptions(self, params: Any, callback: Any) -> Any:
        """Take over subscriptions that the same guest has made on another session."""
        for number in params.SubscriptionIds:
            sub = self.subscription_service.subscriptions.get(int(number))
            owner = self.iserver.owners.get(int(number))
            if sub is None or self.guest is None or owner != self.guest.name:
                raise ServiceError(ua.StatusCodes.BadSubscriptionIdInvalid)
        results = await super().transfer_subscriptions(params, callback)
        for number in params.SubscriptionIds:
            sub = self.subscription_service.subscriptions[int(number)]
            sub.pub_request_callback = callback.__self__.get_publish_request
        return results

    async def delete_subscriptions(self, ids: list[int]) -> list[ua.StatusCode]:
        """Delete subscriptions of the guest's own."""
        for number in ids:
            self._own(number)
        return await super().delete_subscriptions(ids)

    async def set_publishing_mode(self, params: Any) -> Any:
        """Switch subscriptions of the guest's own."""
        for number in params.SubscriptionIds:
            self._own(number)
        return await super().set_publishing_mode(params)

    def _own(self, number: int) -> Any:
        sub = self.subscription_service.subscriptions.get(number)
        if sub is None or sub.session_id != self.session_id:
            raise ServiceError(ua.StatusCodes.BadSubscriptionIdInvalid)
        return sub


def _refused_value() -> ua.DataValue:
    return ua.DataValue(StatusCode=ua.StatusCode(ua.StatusCodes.BadUserAccessDenied))


def _refused_item() -> ua.MonitoredItemCreateResult:
    result = ua.MonitoredItemCreateResult()
    result.StatusCode = ua.StatusCode(ua.StatusCodes.BadUserAccessDenied)
    return result


class Processor(UaProcessor):
    """The services of a connection."""

    iserver: "PlantServer"
    session: Any

    def __init__(self, *arguments: Any) -> None:
        super().__init__(*arguments)
        self._calls: set[asyncio.Task[Any]] = set()

    async def process(self, header: Any, body: Any) -> bool:
        """Read a message; one that cannot be read, or must not be, ends the connection and says why."""
        try:
            return bool(await super().process(header, body))
        except Untrusted as error:
            log.warning("%s is not let in: %s", self.name, error)
            return self._end(ua.StatusCodes.BadCertificateUntrusted, "The certificate is not trusted.")
        except ua.UaError as error:
            log.info("%s: %s", self.name, error)
            return self._end(ua.StatusCodes.BadSecurityChecksFailed, "The message cannot be read.")

    def _end(self, code: int, reason: str) -> bool:
        error = ua.ErrorMessage(ua.StatusCode(code), reason)
        self._transport.write(uatcp_to_binary(ua.MessageType.Error, error))
        return False

    def send_response(self, *arguments: Any, **named: Any) -> None:
        """Send what a client waits for; one that has gone asks for it again when it is back (Republish)."""
        if not self._transport.is_closing():
            super().send_response(*arguments, **named)

    def open_secure_channel(self, algohdr: Any, seqhdr: Any, body: Any) -> None:
        """Open a channel for a trusted client; one without encryption serves discovery alone."""
        if algohdr.SenderCertificate:
            self.iserver.trusted.require(algohdr.SenderCertificate)
        super().open_secure_channel(algohdr, seqhdr, body)

    async def process_message(self, seqhdr: Any, body: Any) -> Any:
        """Serve a request; a call goes on beside the requests that follow, so that a stop never waits."""
        if nodeid_from_binary(body.copy()) != CALL or len(self._calls) >= MOST_CALLS:
            return await super().process_message(seqhdr, body)
        task = asyncio.create_task(super().process_message(seqhdr, body), name="call")
        self._calls.add(task)
        task.add_done_callback(self._calls.discard)
        return True

    async def _process_message(self, typeid: Any, requesthdr: Any, seqhdr: Any, body: Any) -> Any:
        if typeid in REFUSED:
            raise ServiceError(ua.StatusCodes.BadServiceUnsupported)
        if typeid not in DISCOVERY and not self._is_encrypted:
            raise ServiceError(ua.StatusCodes.BadSecurityModeInsufficient)
        if typeid == CREATE_SESSION:
            self._check_certificate(struct_from_binary(ua.CreateSessionParameters, body.copy()))
        if typeid != ACTIVATE_SESSION:
            await super()._process_message(typeid, requesthdr, seqhdr, body)
            self._note(typeid)
            return True
        before = self.session
        try:
            await self._admit(requesthdr, struct_from_binary(ua.ActivateSessionParameters, body.copy()))
            return await super()._process_message(typeid, requesthdr, seqhdr, body)
        except BaseException:
            self.session = before  # another's session stays another's
            raise

    @property
    def _is_encrypted(self) -> bool:
        return bool(self._connection.security_policy.Mode == ua.MessageSecurityMode.SignAndEncrypt)

    def _check_certificate(self, params: ua.CreateSessionParameters) -> None:
        """See that a session is asked for with the certificate of its channel."""
        if params.ClientCertificate != self._connection.security_policy.peer_certificate:
            raise ServiceError(ua.StatusCodes.BadCertificateInvalid)

    def _note(self, typeid: ua.NodeId) -> None:
        if typeid == CREATE_SESSION and isinstance(self.session, Session):
            self.session.certificate = self._connection.security_policy.peer_certificate

    async def _admit(self, requesthdr: Any, params: ua.ActivateSessionParameters) -> None:
        session = self.session or self.iserver.lookup_external_session(requesthdr.AuthenticationToken)
        if not isinstance(session, Session):
            raise ServiceError(ua.StatusCodes.BadSessionIdInvalid)
        if session.certificate != self._connection.security_policy.peer_certificate:
            raise ServiceError(ua.StatusCodes.BadSecurityChecksFailed)
        await session.admit(params)


class _Connection(OPCUAProtocol):
    processor: Any

    def connection_made(self, transport: Any) -> None:
        super().connection_made(transport)
        if self.processor is not None:
            self.processor = Processor(self.iserver, transport, self.limits)
            self.processor.set_policies(self.policies)


class _Listener(BinaryServer):
    def _make_protocol(self) -> OPCUAProtocol:
        return _Connection(self.iserver, self._policies, self.clients, self.closing_tasks, self.limits)


class _Names(UserManager):
    """Gives each its name: who it is, its session has asked the gateway."""

    def get_user(self, *_: Any, username: str | None = None, **__: Any) -> User | None:
        return User(role=UserRole.User, name=username) if username else None


class Where(WhereClauseEvaluator):
    """Selects events for a client: a subtype counts as its type, and a missing field matches nothing."""

    def _eval_el(self, index: int, event: Any) -> Any:
        element = self.elements[index]
        if element.FilterOperator != ua.FilterOperator.OfType:
            return super()._eval_el(index, event)
        wanted = self._eval_op(element.FilterOperands[0], event)
        return wanted in self._types(event.EventType)

    def _eval_op(self, op: Any, event: Any) -> Any:
        try:
            return super()._eval_op(op, event)
        except AttributeError:
            return None

    def _types(self, type_: ua.NodeId) -> list[ua.NodeId]:
        found = [type_]
        while (node := self._aspace.get(found[-1])) is not None:
            above = [
                reference.NodeId
                for reference in node.references
                if not reference.IsForward and reference.ReferenceTypeId == ua.NodeId(ua.ObjectIds.HasSubtype)
            ]
            if not above or above[0] in found:
                break
            found.append(above[0])
        return found


class Subscriptions(SubscriptionService):
    """Subscriptions; an event is told in the language of each session, if its caller may see the event."""

    iserver: "PlantServer"

    async def trigger_event(self, event: Any, subscription_id: int | None = None) -> None:
        """Tell an event, and keep a condition that stands for clients that ask for a refresh."""
        if hasattr(event, "Retain"):
            if event.Retain:
                self._conditions[event.NodeId] = event
            else:
                self._conditions.pop(event.NodeId, None)
        for number in [subscription_id] if subscription_id is not None else list(self.subscriptions):
            await self._tell(number, event)

    async def refresh(self, number: int, item: int | None = None) -> ua.StatusCode:
        """Tell all conditions that stand, between a start and an end; to one who has subscribed."""
        sub = self.subscriptions.get(number)
        guest = GUEST.get()
        if sub is None or guest is None or self.iserver.owners.get(number) != guest.name:
            return ua.StatusCode(ua.StatusCodes.BadSubscriptionIdInvalid)
        await self.standard_events[ua.ObjectIds.RefreshStartEventType].trigger(subscription_id=number)
        for event in list(self._conditions.values()):
            await self._tell(number, event, item)
        await self.standard_events[ua.ObjectIds.RefreshEndEventType].trigger(subscription_id=number)
        return ua.StatusCode()

    async def _tell(self, number: int, event: Any, item: int | None = None) -> None:
        sub = self.subscriptions.get(number)
        if sub is None:
            return
        guest = self.iserver.guest_of(sub.session_id)
        if guest is None or not guest.sees(getattr(event, "address", None)):
            return
        token = GUEST.set(guest)
        try:
            await sub.monitored_item_srv.trigger_event(event, item)
        finally:
            GUEST.reset(token)


class PlantServer(InternalServer):
    """The server's nodes, sessions and subscriptions."""

    def __init__(self, sign_in: SignIn, trusted: Trusted) -> None:
        super().__init__(user_manager=_Names())
        self.sign_in, self.trusted = sign_in, trusted
        self.address_of: AddressOf = lambda _node: None
        """Gives what of the plant a node is about."""
        self.refresh: Refresh = _nothing_newer
        """Reads values again that are older than a number of seconds."""
        self.owners: dict[int, str] = {}
        """Names of the guests who made subscriptions, by their numbers."""
        self.subscription_service = Subscriptions(self.aspace, iserver=self)
        self.isession.subscription_service = self.subscription_service
        self.supported_tokens = (ua.UserNameIdentityToken,)
        self.bind_condition_methods = 500
        self.allow_remote_admin = False
        self.max_connections = MOST_CONNECTIONS
        self.max_subscriptions = MOST_SUBSCRIPTIONS
        self.certificate_validator = CertificateValidator(CertificateValidatorOptions.BASIC_VALIDATION)
        self._works: set[asyncio.Task[Any]] = set()

    def create_session(self, name: str, user: User | None = None, external: bool = False) -> InternalSession:
        """Make a session that no client has activated yet."""
        nobody = user or User(role=UserRole.Anonymous)
        return Session(self, self.aspace, self.subscription_service, name, user=nobody, external=external)

    @property
    def sessions(self) -> list[Session]:
        """All that have a guest."""
        found = [session for session in self._external_sessions.values() if isinstance(session, Session)]
        return [session for session in found if session.guest is not None and session.is_activated()]

    def guest_of(self, session_id: ua.NodeId) -> Guest | None:
        """Give the guest of a session."""
        return next((session.guest for session in self.sessions if session.session_id == session_id), None)

    def judge_fully(self, number: int) -> None:
        """Have the events of a subscription judged by `Where`."""
        sub = self.subscription_service.subscriptions[number]
        guest = self.guest_of(sub.session_id)
        if guest is not None:
            self.owners[number] = guest.name
        for item in sub.monitored_item_srv._monitored_items.values():  # noqa: SLF001  # it has no other door
            judge = item.where_clause_evaluator
            if judge is not None and not isinstance(judge, Where):
                item.where_clause_evaluator = Where(judge.logger, self.aspace, item.filter.WhereClause)

    def soon(self, work: Awaitable[Any]) -> None:
        """Do a work beside the others."""
        task = asyncio.ensure_future(work)
        self._works.add(task)
        task.add_done_callback(self._works.discard)

    async def setup_condition_methods(self) -> None:
        """Bind the refresh of conditions."""
        await super().setup_condition_methods()

        async def refresh(_parent: ua.NodeId, *given: ua.Variant) -> ua.StatusCode:
            return await self.subscription_service.refresh(*(value.Value for value in given))

        for method in (
            ua.ObjectIds.ConditionType_ConditionRefresh,
            ua.ObjectIds.ConditionType_ConditionRefresh2,
        ):
            self.isession.add_method_callback(ua.NodeId(method), refresh)


async def _nothing_newer(_nodes: list[ua.NodeId], _max_age_s: float) -> None:
    return None


class PlantListener(Server):
    """The whole server: endpoints, certificate, address space."""

    iserver: PlantServer

    def __init__(self, iserver: PlantServer, place: tuple[str, int], uri: str, name: str) -> None:
        super().__init__(iserver)
        self.set_endpoint(f"opc.tcp://{place[0]}:{place[1]}/")
        self._place = place
        self._application_uri = uri
        self.product_uri = "urn:motion-gateway:bridge:opcua"
        self.manufacturer_name = "motion-gateway"
        self.application_type = ua.ApplicationType.Server
        self.set_server_name(name)
        self.set_security_policy(list(POLICIES))
        self.limits.max_message_size = MOST_MESSAGE_BYTES
        self.limits.max_chunk_count = MOST_MESSAGE_BYTES // self.limits.max_recv_buffer + 1

    async def listen(self) -> int:
        """Open the port, and give it: 0 takes a free one.

        :raises OSError: it cannot be had.
        """
        await self._setup_server_nodes()
        await self.iserver.start()
        host, port = self._place
        self.bserver = _Listener(self.iserver, host, port, self.limits)
        self.bserver.set_policies(self._policies)
        try:
            await self.bserver.start()
        except OSError:
            await self.iserver.stop()
            raise
        return int(self.bserver.port)

    async def end(self) -> None:
        """Close all connections; what moves goes on."""
        with suppress(Exception):
            await self.stop()
