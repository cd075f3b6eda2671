"""The address space: nodes are added lean, one structure each, and their values written with their times."""

from collections.abc import Awaitable, Callable, Iterable, Sequence
from datetime import UTC, datetime
from importlib.resources import files
from typing import Any, Final, NamedTuple

from asyncua import ua

from bridges.opcua.settings import URI
from bridges.opcua.stack import PlantListener

DI: Final = "http://opcfoundation.org/UA/DI/"
ROBOTICS: Final = "http://opcfoundation.org/UA/Robotics/"
NODESETS: Final = ("Opc.Ua.Di.NodeSet2.xml", "Opc.Ua.Robotics.NodeSet2.xml")
DEVICE_SET: Final = 5001
"""The folder of all devices (DI)."""

CONSTANTS: Final = frozenset(
    getattr(ua.AttributeIds, name)
    for name in (
        "NodeClass",
        "WriteMask",
        "UserWriteMask",
        "IsAbstract",
        "Symmetric",
        "ContainsNoLoops",
        "Historizing",
        "MinimumSamplingInterval",
        "DataType",
        "ValueRank",
        "AccessLevel",
        "UserAccessLevel",
        "Executable",
        "UserExecutable",
    )
)
"""Attributes that stay as a node was made with them."""

Type = ua.VariantType
Method = Callable[..., Awaitable[ua.CallMethodResult]]
GOOD: Final = ua.StatusCode(ua.StatusCodes.Good)


class Argument(NamedTuple):
    """An argument of a method."""

    name: str
    type: ua.VariantType
    told: str


class Space:
    """The nodes of a server; nodes of the plant have string ids, such as `line1.3F.ActualPosition`."""

    def __init__(self, server: PlantListener) -> None:
        self._server = server
        self._aspace = server.iserver.aspace
        self._add = server.iserver.node_mgt_service.add_nodes
        self.own = self.di = self.robotics = 0
        """Indices of namespaces."""
        self._types: dict[str, ua.NodeId] = {}
        self._addresses: dict[ua.NodeId, str] = {}
        self._signatures: dict[tuple[Any, ...], ua.NodeId] = {}

    async def load(self) -> None:
        """Load the types of DI and Robotics."""
        self.own = await self._server.register_namespace(URI)
        for name in NODESETS:
            text = files("bridges.opcua.nodesets").joinpath(name).read_text("utf-8")
            await self._server.import_xml(xmlstring=text)
        self.di = await self._server.get_namespace_index(DI)
        self.robotics = await self._server.get_namespace_index(ROBOTICS)
        for node in list(self._aspace.keys()):
            if node.NamespaceIndex in (self.di, self.robotics):
                its = self._aspace[node].attributes
                if its[ua.AttributeIds.NodeClass].value.Value.Value == ua.NodeClass.ObjectType:
                    self._types[its[ua.AttributeIds.BrowseName].value.Value.Value.Name] = node

    def id(self, name: str) -> ua.NodeId:
        """Give the id of a node of the plant."""
        return ua.NodeId(name, self.own)

    def type(self, name: str) -> ua.NodeId:
        """Give a type of DI or Robotics."""
        return self._types[name]

    @property
    def device_set(self) -> ua.NodeId:
        """The folder of all devices."""
        return ua.NodeId(DEVICE_SET, self.di)

    def address_of(self, node: ua.NodeId) -> str | None:
        """Give the line, body or robot that a node is about; None for what is nothing of the plant."""
        return self._addresses.get(node)

    def has(self, name: str) -> bool:
        """Tell if the plant has a node of this name."""
        return self.id(name) in self._aspace

    def remove(self, address: str) -> None:
        """Take away all nodes of a line, a body or a robot."""
        nodes = [node for node, its in self._addresses.items() if its == address]
        for node in nodes:
            del self._addresses[node]
        item = [ua.DeleteNodesItem(NodeId=node, DeleteTargetReferences=True) for node in nodes]
        self._server.iserver.node_mgt_service.delete_nodes(ua.DeleteNodesParameters(NodesToDelete=item))

    def object(
        self,
        parent: ua.NodeId,
        name: str,
        browse: tuple[str, int],
        type_: ua.NodeId,
        address: str,
        *,
        reference: int = ua.ObjectIds.HasComponent,
        display: str | None = None,
        events: bool = False,
    ) -> ua.NodeId:
        """Add an object; gives its id."""
        attributes = ua.ObjectAttributes(
            DisplayName=ua.LocalizedText(display or browse[0], None),
            EventNotifier=ua.Byte(1 if events else 0),
        )
        return self._node(parent, name, browse, ua.NodeClass.Object, attributes, type_, reference, address)

    def variable(
        self,
        parent: ua.NodeId,
        name: str,
        browse: tuple[str, int],
        value: ua.Variant | None,
        address: str | None,
        *,
        data_type: int | ua.NodeId,
        type_: int = ua.ObjectIds.BaseDataVariableType,
        array: bool = False,
    ) -> ua.NodeId:
        """Add a variable that is read only; without a value it is not supported, for good."""
        attributes = ua.VariableAttributes(
            DisplayName=ua.LocalizedText(browse[0]),
            DataType=ua.NodeId(data_type) if isinstance(data_type, int) else data_type,
            ValueRank=ua.ValueRank.OneDimension if array else ua.ValueRank.Scalar,
            AccessLevel=ua.AccessLevel.CurrentRead.mask,
            UserAccessLevel=ua.AccessLevel.CurrentRead.mask,
            Value=value or ua.Variant(None, Type.Null),
        )
        is_property = type_ == ua.ObjectIds.PropertyType
        reference = ua.ObjectIds.HasProperty if is_property else ua.ObjectIds.HasComponent
        node = self._node(
            parent, name, browse, ua.NodeClass.Variable, attributes, ua.NodeId(type_), reference, address
        )
        if value is None:
            self._aspace[node].attributes[ua.AttributeIds.Value].value = not_supported()
        return node

    def property(
        self,
        parent: ua.NodeId,
        name: str,
        browse: tuple[str, int],
        value: ua.Variant | None,
        address: str,
        *,
        data_type: int | ua.NodeId,
    ) -> ua.NodeId:
        """Add a property."""
        return self.variable(
            parent, name, browse, value, address, data_type=data_type, type_=ua.ObjectIds.PropertyType
        )

    def method(
        self,
        parent: ua.NodeId,
        name: str,
        browse: tuple[str, int],
        call: Method,
        address: str,
        *,
        takes: Sequence[Argument] = (),
        gives: Sequence[Argument] = (),
    ) -> ua.NodeId:
        """Add a method; methods with the same arguments share the nodes that describe them."""
        attributes = ua.MethodAttributes(
            DisplayName=ua.LocalizedText(browse[0]), Executable=True, UserExecutable=True
        )
        node = self._node(
            parent,
            name,
            browse,
            ua.NodeClass.Method,
            attributes,
            ua.NodeId(),
            ua.ObjectIds.HasComponent,
            address,
        )
        for which, arguments in (("InputArguments", takes), ("OutputArguments", gives)):
            if arguments:
                self._describe(node, which, tuple(arguments))
        self._server.iserver.isession.add_method_callback(node, call)
        return node

    def refer(self, source: ua.NodeId, target: ua.NodeId, reference: int = ua.ObjectIds.HasComponent) -> None:
        """Let a node refer to another, and be referred to."""
        kind = ua.NodeId(reference)
        pairs = ((source, target, True), (target, source, False))
        items = [
            ua.AddReferencesItem(
                SourceNodeId=one, ReferenceTypeId=kind, IsForward=forward, TargetNodeId=other
            )
            for one, other, forward in pairs
        ]
        for status in self._server.iserver.node_mgt_service.add_references(items):
            status.check()

    async def write(self, node: ua.NodeId, value: ua.DataValue) -> None:
        """Write a value."""
        await self._aspace.write_attribute_value(node, ua.AttributeIds.Value, value)

    def value(self, node: ua.NodeId) -> ua.DataValue:
        """Give a value as it is told now."""
        return self._aspace.read_attribute_value(node, ua.AttributeIds.Value)

    def is_monitored(self, node: ua.NodeId) -> bool:
        """Tell if a client monitors a value."""
        its = self._aspace.get(node)
        return its is not None and bool(its.attributes[ua.AttributeIds.Value].datachange_callbacks)

    def event_type(self, name: str, fields: Iterable[tuple[str, ua.VariantType]]) -> ua.NodeId:
        """Add a type of events with fields of its own."""
        attributes = ua.ObjectTypeAttributes(DisplayName=ua.LocalizedText(name))
        node = self._node(
            ua.NodeId(ua.ObjectIds.BaseEventType),
            name,
            (name, self.own),
            ua.NodeClass.ObjectType,
            attributes,
            ua.NodeId(),
            ua.ObjectIds.HasSubtype,
            None,
        )
        for field, type_ in fields:
            self.variable(
                node,
                f"{name}.{field}",
                (field, self.own),
                ua.Variant(ua.get_default_value(type_), type_),
                None,
                data_type=type_.value,
                type_=ua.ObjectIds.PropertyType,
            )
        return node

    def _describe(self, method: ua.NodeId, which: str, arguments: tuple[Argument, ...]) -> None:
        key = (which, arguments)
        if key in self._signatures:
            self.refer(method, self._signatures[key], ua.ObjectIds.HasProperty)
            return
        values = [
            ua.Argument(
                Name=argument.name,
                DataType=ua.NodeId(argument.type.value),
                ValueRank=ua.ValueRank.Scalar,
                Description=ua.LocalizedText(argument.told),
            )
            for argument in arguments
        ]
        self._signatures[key] = self.variable(
            method,
            f"arguments.{len(self._signatures)}",
            (which, 0),
            ua.Variant(values, Type.ExtensionObject),
            None,
            data_type=ua.ObjectIds.Argument,
            type_=ua.ObjectIds.PropertyType,
            array=True,
        )

    def _node(
        self,
        parent: ua.NodeId,
        name: str,
        browse: tuple[str, int],
        class_: ua.NodeClass,
        attributes: Any,
        type_: ua.NodeId,
        reference: int,
        address: str | None,
    ) -> ua.NodeId:
        node = self.id(name)
        item = ua.AddNodesItem(
            ParentNodeId=parent,
            ReferenceTypeId=ua.NodeId(reference),
            RequestedNewNodeId=node,
            BrowseName=ua.QualifiedName(*browse),
            NodeClass=class_,
            NodeAttributes=attributes,
            TypeDefinition=type_,
        )
        self._add([item])[0].StatusCode.check()
        if address is not None:
            self._addresses[node] = address
        return node


def told(value: ua.Variant, at: datetime | None, status: ua.StatusCode = GOOD) -> ua.DataValue:
    """Make a value of what a controller has said at a time."""
    return ua.DataValue(value, StatusCode=status, SourceTimestamp=at, ServerTimestamp=datetime.now(UTC))


def bad(code: int) -> ua.DataValue:
    """Make a data value without a value, with the status `code` that says why there is none."""
    return ua.DataValue(StatusCode=ua.StatusCode(code), ServerTimestamp=datetime.now(UTC))


def not_supported() -> ua.DataValue:
    """Make a value of what the gateway never knows."""
    return bad(ua.StatusCodes.BadNotSupported)


def text(value: str) -> ua.Variant:
    """Make a text that has no language."""
    return ua.Variant(ua.LocalizedText(value), Type.LocalizedText)


def string(value: str) -> ua.Variant:
    """Make a string."""
    return ua.Variant(value, Type.String)


def share_constants(aspace: Any) -> None:
    """Let nodes share what is the same in thousands of them, and never written: a third of their memory."""
    known: dict[tuple[ua.AttributeIds, Any], Any] = {}
    for node in list(aspace.keys()):
        attributes = aspace[node].attributes
        for attribute in CONSTANTS & attributes.keys():
            its = attributes[attribute]
            variant = its.value.Value if its.value is not None else None
            if variant is None or its.datachange_callbacks:
                continue
            key = (attribute, variant.Value if not isinstance(variant.Value, list) else None)
            if key[1] is not None:
                attributes[attribute] = known.setdefault(key, its)
