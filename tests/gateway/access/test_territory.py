"""The addresses that a scope covers."""

import pytest

from gateway.access.errors import NotAuthenticated, NotPermitted
from gateway.access.principal import EVERYBODY, Principal, asking, current
from gateway.access.roles import RIGHTS_OF, Role
from gateway.config import Config
from gateway.core.errors import Ambiguous
from gateway.core.rights import Right
from gateway.plant import Plant
from gateway.rorze.bodies import Group
from gateway.rorze.family import Rorze


@pytest.fixture
def plant() -> Plant:
    bodies = [{"id": "00"}, {"id": "3F"}]
    robot = {"id": "r1", "units": [{"number": 1, "axes": ["X"]}]}
    lines = [
        {"id": "arm", "address": "tcp://127.0.0.1:1", "bodies": [*bodies, {"id": "01"}],
         "groups": [{"id": "80", "members": ["01", "3F"]}]},
        {"id": "leg", "address": "tcp://127.0.0.1:2", "bodies": bodies},
        {"id": "cell", "address": "tcp://127.0.0.1:3", "protocol": "fics", "robot": robot},
    ]  # fmt: skip
    return Plant(Config.model_validate({"lines": lines}))


def somebody(*scope: str, role: Role = Role.ADMIN) -> Principal:
    return Principal("somebody", role, frozenset(scope))


@pytest.mark.parametrize(
    ("scope", "address", "covered"),
    [
        ("arm", "arm.3F", True),
        ("arm", "arm.3f", True),
        ("arm", "01", True),
        ("arm", "80", True),
        ("arm", "arm", True),
        ("arm", "leg.3F", False),
        ("arm", "r1", False),
        ("arm.3F", "arm.3F", True),
        ("ARM.3f", "arm.3F", True),
        ("arm.3F", "arm", False),
        ("arm.3F", "arm.80", False),
        ("01", "arm.01", True),
        ("3F", "arm.3F", False),  # two lines have it
        ("80", "arm.01", True),
        ("80", "arm.80", True),
        ("80", "arm.00", False),
        ("cell", "r1", True),
        ("cell", "r1/units/1", True),
        ("r1", "r1/units/1", True),
        ("r1", "cell", False),
        ("arm", "arm.81", True),  # a new group is a matter of its line
        ("arm.3F", "arm.81", False),
        ("arm", "81", False),
        ("nowhere", "nowhere", False),
        ("arm", "", False),
        ("arm", ".", False),
    ],
)
def test_what_a_scope_covers(plant: Plant, scope: str, address: str, covered: bool) -> None:
    assert plant.access.territory.covers(somebody(scope), address) is covered


def test_an_address_of_two_lines_is_told_as_such(plant: Plant) -> None:
    with pytest.raises(Ambiguous):
        plant.access.territory.covers(somebody("arm"), "3F")


def test_a_group_defined_anew_gives_nobody_more(plant: Plant) -> None:
    territory = plant.access.territory
    rorze = plant.family(Rorze)
    rorze._groups._add(Group(rorze.lines["arm"], 0x80, [rorze.body("arm.00"), rorze.body("arm.01")]))
    key = somebody("arm.80")
    assert territory.covers(key, "arm.3F")
    assert not territory.covers(key, "arm.00")
    assert not territory.covers(key, "arm.80")


def test_who_may_do_everything_needs_no_address(plant: Plant) -> None:
    territory = plant.access.territory
    territory.require(EVERYBODY, Right.ADMIN)
    territory.require(EVERYBODY, Right.OPERATE, "nowhere")
    with pytest.raises(NotPermitted, match="whole plant"):
        territory.require(somebody("arm"), Right.VIEW)
    with pytest.raises(NotPermitted, match=r"not for leg\.00"):
        territory.require(somebody("arm"), Right.VIEW, "arm.00", "leg.00")


@pytest.mark.parametrize("role", list(Role))
def test_every_role_stops_everything_and_has_what_the_one_before_has(plant: Plant, role: Role) -> None:
    nothing = Principal("somebody", role, frozenset())
    plant.access.territory.require(nothing, Right.STOP)
    plant.access.territory.require(nothing, Right.STOP, "leg.00")
    for other in list(Role)[: list(Role).index(role)]:
        assert RIGHTS_OF[other] < RIGHTS_OF[role]


def test_who_asks_is_known_while_it_is_done_and_nobody_else() -> None:
    with pytest.raises(NotAuthenticated):
        current()
    with asking(EVERYBODY):
        assert current() is EVERYBODY
    with pytest.raises(NotAuthenticated):
        current()
