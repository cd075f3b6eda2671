"""Mended parts of the library: sessions are their owners', and events are judged by their supertypes."""

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from asyncua import ua
from asyncua.common.connection import TransportLimits
from asyncua.common.utils import Buffer, ServiceError
from asyncua.ua.ua_binary import struct_to_binary

from bridges.opcua.certificates import Trusted
from bridges.opcua.sessions import SignInRefused
from bridges.opcua.stack import ACTIVATE_SESSION, CALL, PlantServer, Processor, Where
from tests.bridges.loops import in_a_loop


class Transport:
    """A connection that nobody reads."""

    def __init__(self, *, closing: bool = False) -> None:
        self.closing = closing
        self.written: list[bytes] = []

    def get_extra_info(self, _name: str) -> tuple[str, int]:
        return "127.0.0.1", 1

    def is_closing(self) -> bool:
        return self.closing

    def write(self, data: bytes) -> None:
        self.written.append(data)


async def nobody(*_: Any) -> Any:
    raise SignInRefused("nobody is known")


def processor_of(server: PlantServer, *, encrypted: bool = True) -> Processor:
    processor = Processor(server, Transport(), TransportLimits())
    if encrypted:
        policy = processor._connection.security_policy
        policy.Mode, policy.peer_certificate = ua.MessageSecurityMode.SignAndEncrypt, b"mine"
    return processor


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    return tmp_path


@in_a_loop
async def test_a_session_is_not_had_by_asking_for_it(folder: Path) -> None:
    server = PlantServer(nobody, Trusted(folder / "trusted", folder / "rejected"))
    theirs: Any = server.create_session("theirs", external=True)
    for certificate in (b"theirs", b"mine"):  # another client's, and one with the same certificate
        theirs.certificate = certificate
        processor = processor_of(server)
        request = ua.RequestHeader(AuthenticationToken=theirs.auth_token)
        token = ua.UserNameIdentityToken(UserName="x", Password=b"y")
        params = ua.ActivateSessionParameters(UserIdentityToken=token)
        body = Buffer(struct_to_binary(params))
        with pytest.raises(ServiceError):
            await processor._process_message(ACTIVATE_SESSION, request, SimpleNamespace(), body)
        assert processor.session is None


@in_a_loop
async def test_names_of_sessions_cannot_be_guessed(folder: Path) -> None:
    server = PlantServer(nobody, Trusted(folder / "trusted", folder / "rejected"))
    tokens = {bytes(server.create_session("x", external=True).auth_token.Identifier) for _ in range(10)}
    assert len(tokens) == 10
    assert {len(it) for it in tokens} == {32}


@in_a_loop
async def test_nothing_but_discovery_is_served_without_encryption(folder: Path) -> None:
    server = PlantServer(nobody, Trusted(folder / "trusted", folder / "rejected"))
    processor = processor_of(server, encrypted=False)
    with pytest.raises(ServiceError) as refused:
        await processor._process_message(CALL, ua.RequestHeader(), SimpleNamespace(), Buffer(b""))
    assert refused.value.code == ua.StatusCodes.BadSecurityModeInsufficient


def test_what_is_made_by_a_type_is_of_its_supertypes_and_a_missing_field_is_none() -> None:
    made, above = ua.NodeId(1, 1), ua.NodeId(2, 1)
    up = SimpleNamespace(NodeId=above, IsForward=False, ReferenceTypeId=ua.NodeId(ua.ObjectIds.HasSubtype))
    aspace = {made: SimpleNamespace(references=[up]), above: SimpleNamespace(references=[])}
    event = SimpleNamespace(EventType=made)

    def judged(wanted: ua.NodeId) -> bool:
        element = ua.ContentFilterElement(
            FilterOperator=ua.FilterOperator.OfType,
            FilterOperands=[ua.LiteralOperand(Value=ua.Variant(wanted))],
        )
        return bool(Where(None, aspace, ua.ContentFilter(Elements=[element])).eval(event))

    assert [judged(it) for it in (made, above, ua.NodeId(3, 1))] == [True, True, False]
    missing = ua.SimpleAttributeOperand(BrowsePath=[ua.QualifiedName("Missing")])
    is_null = ua.ContentFilterElement(FilterOperator=ua.FilterOperator.IsNull, FilterOperands=[missing])
    assert Where(None, aspace, ua.ContentFilter(Elements=[is_null])).eval(event)
