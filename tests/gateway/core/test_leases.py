"""Leases, and the commands that they keep out; a model checks every step."""

import asyncio
from collections.abc import Iterator, Sequence
from itertools import product
from pathlib import Path
from typing import Any

import pytest
from hypothesis import settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, invariant, precondition, rule

from gateway.core.errors import GatewayError, NotAllowed, NotFound, NotSent
from gateway.core.leases import (
    AHEAD,
    FILE,
    End,
    Holder,
    Lease,
    LeaseRefused,
    Leases,
    LeaseTokens,
    Mode,
    Taken,
)
from gateway.core.origin import Claim, Origin, acting
from gateway.core.parts import Part
from protocols.rorze.moves import MoveClockwise
from protocols.rorze.position import GetPosition, SetPosition
from protocols.rorze.stops import StopDecelerating
from tests.gateway.rorze.exchanges import exchange

ANNA, BERT = Holder("anna", "a1"), Holder("bert", "b1")
ARM, LEG = Part("arm", "arm"), Part("leg", "leg")
LIFT, TURN, FOOT = Part("arm", "arm.3F"), Part("arm", "arm.00"), Part("leg", "leg.00")
MOVE, SETTING = MoveClockwise(distance=1), SetPosition(position=0)


class Hall:
    """Leases on a clock of their own, and who wants them."""

    def __init__(self, mode: Mode = "optional") -> None:
        self.now = 0.0
        self.leases = Leases(mode, LeaseTokens(), lambda: self.now)
        self.ended: list[tuple[str, End]] = []
        self.leases.on_end.append(lambda _subject, lease, why: self.ended.append((lease.lease, why)))

    def take(self, holder: Holder, *parts: Part, ttl_s: float = 10.0, over: bool = False) -> Taken:
        async def taking() -> Taken:
            taken = await self.leases.take("it", "/bodies/it", parts, holder, ttl_s, over=over)
            self.leases.close()
            return taken

        return asyncio.run(taking())

    def may(self, part: Part, *tokens: int, by: Holder = ANNA) -> bool:
        try:
            self.leases.admit(Claim(tokens, (part,), by.id))
        except LeaseRefused:
            return False
        return True


@pytest.fixture
def hall() -> Hall:
    return Hall()


# what a lease keeps out


def test_without_leases_everybody_moves_everything(hall: Hall) -> None:
    assert hall.may(LIFT)


def test_what_is_leased_is_moved_with_its_token_only(hall: Hall) -> None:
    token = hall.take(ANNA, LIFT).token
    assert hall.may(LIFT, token)
    assert not hall.may(LIFT)
    with pytest.raises(LeaseRefused) as refusal:
        hall.leases.admit(Claim((), (LIFT,), ANNA.id))
    assert "send its token as Lease-Token" in refusal.value.remedy
    assert not hall.may(LIFT, token - 1)
    assert not hall.may(LIFT, token + 1)
    assert hall.may(TURN)


def test_a_token_is_good_for_the_holder_alone(hall: Hall) -> None:
    taken = hall.take(ANNA, LIFT)
    everything = range(taken.token + 10)
    assert hall.may(LIFT, *everything, by=ANNA)
    with pytest.raises(LeaseRefused, match="leased to anna"):
        hall.leases.admit(Claim(tuple(everything), (LIFT,), BERT.id))
    with pytest.raises(LeaseRefused, match="not yours"):
        hall.leases.renew(taken.lease, Claim((taken.token,), holder=BERT.id))
    claim = Claim((taken.token,), (LIFT,), BERT.id)
    assert isinstance(written(hall, MOVE, claim), LeaseRefused), "nor at the gate"


def test_a_line_has_all_that_is_on_it(hall: Hall) -> None:
    token = hall.take(ANNA, ARM).token
    assert hall.may(LIFT, token)
    assert not hall.may(LIFT)
    assert hall.may(FOOT)


def test_who_asks_for_a_body_of_a_leased_line_is_told_of_the_body_and_who_asks_for_the_line_of_it_all(
    hall: Hall,
) -> None:
    hall.take(ANNA, ARM)
    for asked in (LIFT, TURN, ARM):
        with pytest.raises(LeaseRefused, match=f"^{asked.address} is leased to anna"):
            hall.leases.admit(Claim((), (asked,), BERT.id))
        with pytest.raises(LeaseRefused, match=f"^{asked.address} is leased to anna"):
            hall.take(BERT, asked)


def test_a_line_is_set_by_nobody_while_a_body_of_it_is_leased_to_somebody_else(hall: Hall) -> None:
    token = hall.take(ANNA, LIFT).token
    assert not hall.may(ARM)
    assert not hall.may(ARM, token)


def test_several_tokens_stand_side_by_side(hall: Hall) -> None:
    tokens = hall.take(ANNA, LIFT).token, hall.take(ANNA, TURN).token
    assert hall.leases.admit(Claim(tokens, (LIFT, TURN), ANNA.id)).tokens == tokens
    with pytest.raises(LeaseRefused):
        hall.leases.admit(Claim(tokens[:1], (LIFT, TURN), ANNA.id))


def test_a_token_of_a_lease_elsewhere_is_refused_where_nobody_has_one(hall: Hall) -> None:
    assert not hall.may(FOOT, hall.take(ANNA, LIFT).token)


def test_where_leases_are_required_nothing_moves_without(hall: Hall) -> None:
    hall = Hall("required")
    assert not hall.may(LIFT)
    assert hall.may(LIFT, hall.take(ANNA, LIFT).token)


def test_switched_off_leases_are_neither_given_nor_asked_for() -> None:
    hall = Hall("off")
    assert hall.may(LIFT, 7)
    with pytest.raises(NotAllowed, match="switched off"):
        hall.take(ANNA, LIFT)


# how it ends


def test_a_lease_ends_with_its_time_and_its_token_with_it(hall: Hall) -> None:
    token = hall.take(ANNA, LIFT, ttl_s=10.0).token
    hall.now = 9.9
    assert hall.may(LIFT, token)
    hall.now = 10.0
    assert not hall.may(LIFT, token), "though nobody else has a lease"
    assert hall.may(LIFT)
    assert hall.ended == [("lease-1", "expired")]


def test_a_renewed_lease_lasts_for_its_whole_time_again(hall: Hall) -> None:
    taken = hall.take(ANNA, LIFT, ttl_s=10.0)
    hall.now = 9.0
    assert hall.leases.renew(taken.lease, Claim((taken.token,), holder=ANNA.id)).expires_in_s == 10.0
    hall.now = 18.9
    assert hall.may(LIFT, taken.token)
    with pytest.raises(LeaseRefused, match="not that of"):
        hall.leases.renew(taken.lease, Claim((taken.token + 1,), holder=ANNA.id))


def test_a_lease_that_is_over_is_not_renewed(hall: Hall) -> None:
    taken = hall.take(ANNA, LIFT, ttl_s=1.0)
    hall.now = 1.0
    with pytest.raises(NotFound, match="or it is over"):
        hall.leases.renew(taken.lease, Claim((taken.token,), holder=ANNA.id))


def test_nobody_leases_what_is_leased_but_by_taking_it_over(hall: Hall) -> None:
    first = hall.take(ANNA, LIFT)
    with pytest.raises(LeaseRefused, match=r"leased to anna for 10.0 s; nothing was sent"):
        hall.take(BERT, ARM)
    second = hall.take(BERT, ARM, over=True)
    assert second.token > first.token
    assert (hall.may(LIFT, second.token, by=BERT), hall.may(LIFT, first.token)) == (True, False)
    assert hall.ended == [(first.lease, "taken_over")]


@pytest.mark.parametrize(("by", "why"), [(ANNA, "released"), (BERT, "broken")])
def test_a_lease_is_given_back_or_broken(hall: Hall, by: Holder, why: End) -> None:
    taken = hall.take(ANNA, LIFT)
    hall.leases.end(taken.lease, by)
    assert (hall.ended, hall.leases.all(), hall.may(LIFT)) == ([(taken.lease, why)], [], True)


def test_only_its_holder_is_told_the_token(hall: Hall) -> None:
    hall.take(ANNA, LIFT)
    (shown,) = hall.leases.all()
    assert type(shown) is Lease


# at the gate


def written(hall: Hall, command: Any, claim: Claim, work: Any = "clients") -> GatewayError | None:
    with acting(Origin("anna", claim=claim, work=work)):
        return hall.leases.guard("arm")(exchange(command), 0.0)


def test_what_was_admitted_is_not_written_after_the_lease(hall: Hall) -> None:
    token = hall.take(ANNA, LIFT, ttl_s=10.0).token
    claim = hall.leases.admit(Claim((token,), (LIFT,), ANNA.id))
    assert written(hall, MOVE, claim) is None
    hall.now = 10.0
    for command in (MOVE, SETTING):
        assert isinstance(written(hall, command, claim), LeaseRefused)


def test_what_was_admitted_without_a_lease_is_not_written_once_somebody_else_has_one(hall: Hall) -> None:
    claim = hall.leases.admit(Claim((), (LIFT,), ANNA.id))
    hall.take(BERT, LIFT)
    assert isinstance(written(hall, MOVE, claim), LeaseRefused)


def test_stops_pass_and_so_does_what_follows_a_move_to_its_end(hall: Hall) -> None:
    claim = Claim((hall.take(ANNA, LIFT).token,), (LIFT,), ANNA.id)
    hall.now = 10.0
    assert written(hall, StopDecelerating(), claim) is None
    assert written(hall, SETTING, claim, "followers") is None
    assert isinstance(written(hall, MOVE, claim, "followers"), LeaseRefused)


def test_a_motion_that_nobody_admitted_is_not_written_on_a_line_with_a_lease(hall: Hall) -> None:
    assert written(hall, MOVE, Claim()) is None
    hall.take(ANNA, LIFT)
    assert isinstance(written(hall, MOVE, Claim()), LeaseRefused)
    assert written(hall, GetPosition(), Claim()) is None


# against a model


class Machine(RuleBasedStateMachine):
    """Clients take, renew and lose leases; who holds what is written here, too."""

    def __init__(self) -> None:
        super().__init__()
        self.hall = Hall()
        self.held: list[tuple[Taken, Holder, Sequence[Part], float]] = []
        self.given: list[int] = []

    def lasting(self) -> Iterator[tuple[Taken, Holder, Sequence[Part]]]:
        return ((taken, holder, parts) for taken, holder, parts, until in self.held if self.hall.now < until)

    @rule(
        holder=st.sampled_from([ANNA, BERT]),
        parts=st.lists(st.sampled_from([ARM, LEG, LIFT, TURN, FOOT]), min_size=1, max_size=2, unique=True),
        ttl_s=st.sampled_from([1.0, 5.0]),
        over=st.booleans(),
    )
    def take(self, holder: Holder, parts: list[Part], ttl_s: float, over: bool) -> None:
        meets = [it for it, _, theirs in self.lasting() if any(a.meets(b) for a in theirs for b in parts)]
        if meets and not over:
            with pytest.raises(LeaseRefused):
                self.hall.take(holder, *parts, ttl_s=ttl_s)
            return
        taken = self.hall.take(holder, *parts, ttl_s=ttl_s, over=over)
        assert taken.token > max(self.given, default=0)
        self.given.append(taken.token)
        self.held = [it for it in self.held if it[0] not in meets]
        self.held.append((taken, holder, parts, self.hall.now + ttl_s))

    @precondition(lambda self: self.held)
    @rule(data=st.data())
    def end(self, data: st.DataObject) -> None:
        taken, holder, _, until = gone = data.draw(st.sampled_from(self.held))
        if self.hall.now < until:
            self.hall.leases.end(taken.lease, holder)
            self.held.remove(gone)

    @rule(seconds=st.sampled_from([0.5, 1.0, 5.0]))
    def wait(self, seconds: float) -> None:
        self.hall.now += seconds

    @invariant()
    def only_good_tokens_move(self) -> None:
        lasting = list(self.lasting())
        for part in (ARM, LIFT, TURN, FOOT):
            near = [it for it in lasting if any(own.meets(part) for own in it[2])]
            assert self.hall.may(part) == (not near)
            for token, by in product(self.given, (ANNA, BERT)):
                own = [parts for taken, holder, parts in near if (taken.token, holder) == (token, by)]
                alone = len(near) == 1 and bool(own) and any(it.contains(part) for it in own[0])
                assert self.hall.may(part, token, by=by) == alone


Machine.TestCase.settings = settings(max_examples=60, stateful_step_count=20, deadline=None)
TestLeases = Machine.TestCase


def test_where_all_are_one_a_lease_is_that_of_another_caller(hall: Hall) -> None:
    everybody = Holder("everybody", "")
    hall.take(everybody, LIFT)
    with pytest.raises(LeaseRefused, match=r"leased to another caller without a key for 10.0 s; nothing was"):
        hall.leases.admit(Claim((), (LIFT,), everybody.id))


def given(tokens: LeaseTokens, count: int) -> list[int]:
    async def take() -> list[int]:
        return [await tokens.next() for _ in range(count)]

    return asyncio.run(take())


def test_each_number_is_given_once_by_whichever_life_of_the_gateway(tmp_path: Path) -> None:
    lives = [given(LeaseTokens(tmp_path), count) for count in (1, 3, AHEAD + 1, 2)]
    numbers = [number for life in lives for number in life]
    assert numbers == sorted(set(numbers))


def test_a_number_is_written_down_before_it_is_given(tmp_path: Path) -> None:
    (last,) = given(LeaseTokens(tmp_path), 1)
    assert int((tmp_path / FILE).read_text()) > last


def test_clients_at_once_get_numbers_of_their_own(tmp_path: Path) -> None:
    async def take() -> list[int]:
        tokens = LeaseTokens(tmp_path)
        return list(await asyncio.gather(*(tokens.next() for _ in range(50))))

    assert len(set(asyncio.run(take()))) == 50


def test_without_a_directory_they_begin_anew() -> None:
    assert given(LeaseTokens(), 3) == [1, 2, 3]


def test_what_cannot_be_written_down_is_not_given(tmp_path: Path) -> None:
    (tmp_path / FILE).write_text("no number")
    with pytest.raises(NotSent, match="cannot be written down"):
        given(LeaseTokens(tmp_path), 1)
