"""The address space: what is shared between nodes, and what never is."""

from asyncua import ua
from asyncua.server.address_space import AddressSpace, NodeManagementService

from bridges.opcua.nodes import share_constants
from tests.bridges.loops import in_a_loop


def variable(number: int, value: float) -> ua.AddNodesItem:
    attributes = ua.VariableAttributes(
        DisplayName=ua.LocalizedText("x"),
        DataType=ua.NodeId(ua.ObjectIds.Double),
        Value=ua.Variant(value, ua.VariantType.Double),
    )
    return ua.AddNodesItem(
        RequestedNewNodeId=ua.NodeId(number, 1),
        BrowseName=ua.QualifiedName("x", 1),
        NodeClass=ua.NodeClass.Variable,
        NodeAttributes=attributes,
    )


@in_a_loop
async def test_nodes_share_what_is_never_written_and_nothing_else() -> None:
    aspace = AddressSpace()
    service = NodeManagementService(aspace)
    list(service.try_add_nodes([variable(1, 1.0), variable(2, 1.0)], check=False))
    one, two = (aspace[ua.NodeId(number, 1)].attributes for number in (1, 2))

    share_constants(aspace)

    assert one[ua.AttributeIds.DataType] is two[ua.AttributeIds.DataType]
    assert one[ua.AttributeIds.Value] is not two[ua.AttributeIds.Value]
    await aspace.write_attribute_value(
        ua.NodeId(1, 1), ua.AttributeIds.Value, ua.DataValue(ua.Variant(7.0, ua.VariantType.Double))
    )
    values = [it[ua.AttributeIds.Value].value.Value.Value for it in (one, two)]
    assert values == [7.0, 1.0]
