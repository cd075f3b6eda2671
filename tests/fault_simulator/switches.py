"""The off switches of the safety rules, for tests alone: with any of them, something has to fail."""

import asyncio
import time
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import pytest

from gateway.core.admission import Admission
from gateway.core.errors import GatewayError, NoReply, NotSent
from gateway.core.events import EventHub
from gateway.core.exchange import Exchange, Lane
from gateway.core.false_replies import Copies
from gateway.core.gate import Gate
from gateway.core.journal import intents, opening
from gateway.core.journal.intents import Intents
from gateway.core.journal.journal import Writer
from gateway.core.line import LineDriver
from gateway.core.move_record import Move, MoveStatus
from gateway.core.move_runs import MoveRun
from gateway.core.origin import Origin, acting
from gateway.core.session import Session
from gateway.door.keys import Keys
from gateway.fics import moves as moves_of_robots
from gateway.fics.conversation import Conversation
from gateway.fics.line import FicsLine
from gateway.fics.stops import _RobotStop
from gateway.rorze import move_proof
from gateway.rorze.bodies import Body
from gateway.rorze.guards import Guards
from gateway.rorze.moves import Moves
from gateway.rorze.power import Mark
from gateway.rorze.session import RorzeExchange, RorzeSession
from gateway.rorze.stops import _BodyStop
from protocols.rorze.commands import COMMANDS
from protocols.rorze.link import HALF_COMMAND_ENDS
from protocols.table import Effect
from tests.api.common import test_idempotent_requests
from tests.gateway import test_plant
from tests.gateway.core.journal import test_intents, test_journal
from tests.gateway.door import test_moves
from tests.gateway.fics import test_move_runs
from tests.gateway.rorze import test_body_power, test_move_proof, test_stops, test_suspension
from tests.simulation import test_cut_lines_of_robots, test_faulty_robot
from tests.simulation.test_cut_lines_of_robots import Case, Untouched
from tests.world import World

Patch = pytest.MonkeyPatch


class Switch(NamedTuple):
    """One rule, switched off."""

    rule: str
    off: Callable[[Patch], None]
    seeds: Sequence[int] = range(60)
    """Seeds in which the fault simulator has to see it; robots are the odd pairs (2, 3, 6, 7, ...)."""
    by_replay: bool = False
    """True if only a comparison with a run without jumps of the wall clock shows the difference."""


ROBOTS = [seed for seed in range(120) if seed % 4 > 1]
BODIES = [seed for seed in range(120) if seed % 4 < 2]


async def _true(*_: Any) -> bool:
    return True


def _nothing(*_: Any, **__: Any) -> None:
    return None


def _never(*_: Any, **__: Any) -> bool:
    return False


def no_fence(patch: Patch) -> None:
    patch.setattr(RorzeSession, "_lose_step", lambda session, *_, **__: session._settle_suspect())
    patch.setattr(Copies, "could_answer", _never)


def no_fence_of_robots(patch: Patch) -> None:
    patch.setattr(
        "gateway.fics.session.FicsSession._lose_step", lambda session, *_, **__: session._settle_suspect()
    )
    patch.setattr(Copies, "could_answer", _never)


def any_body_answers(patch: Patch) -> None:
    def credit(exchange: RorzeExchange, frame: Any, now: float) -> Any:
        return heard(exchange, replace(frame, body=exchange.target), now)

    heard = RorzeExchange.credit
    patch.setattr(RorzeExchange, "credit", credit)


def no_epoch(patch: Patch) -> None:
    patch.setattr(Gate, "epoch", lambda *_: 0)
    patch.setattr(LineDriver, "cancel", _nothing)
    patch.setattr(Guards, "_while_stopping", _nothing)


def repeat_unasked(patch: Patch) -> None:
    def settle(session: Any, *_: Any) -> None:
        suspect = session._suspect
        if suspect is not None and suspect.command.effect is not Effect.READ and suspect.reply.repeats == 0:
            suspect.reply.repeats = 1
        settled(session)

    settled = Session._settle_suspect
    patch.setattr(Session, "_settle_suspect", settle)


def stops_without_proof(patch: Patch) -> None:
    patch.setattr(_BodyStop, "_stands_still", _true)


def stops_of_robots_without_proof(patch: Patch) -> None:
    patch.setattr(_RobotStop, "_stands_still", _true)


def no_intents(patch: Patch) -> None:
    patch.setattr(Intents, "must_come_first", _never)


def intent_after_the_first_byte(patch: Patch) -> None:
    def hold(self: Intents[Any], exchange: Any, admit: Callable[[Any], None]) -> None:
        exchange.intent = intents._new_id()
        self._follow(exchange)
        admit(exchange)
        self._book.note(self._entry(exchange, exchange.intent))

    patch.setattr(Intents, "hold", hold)


def commits_are_not_synced(patch: Patch) -> None:
    def attempt(self: Writer, batch: Any, *, durable: bool) -> Any:
        told: Any = self.settle
        return tried(self, batch, durable=durable and told.__self__.trouble is not None)

    tried = Writer._try
    patch.setattr(Writer, "_try", attempt)


def a_full_disk_forgets(patch: Patch) -> None:
    patch.setattr(Writer, "_owe", _nothing)


def a_crash_looks_clean(patch: Patch) -> None:
    def begin(*arguments: Any) -> Any:
        found = begun(*arguments)
        epoch = list(found.earlier)[-1] if found.earlier else found.epoch
        return found._replace(was_clean=True, epoch=epoch)

    begun = opening.begin
    patch.setattr("tests.fault_simulator.world.begin", begin)


def numbers_begin_anew(patch: Patch) -> None:
    resumed = EventHub.resume

    def resume(hub: EventHub, epoch: str, earlier: Any, last: int, events: Any) -> None:
        resumed(hub, [*earlier, epoch][0], {}, min(last, 3), events[:3])

    patch.setattr(EventHub, "resume", resume)


def records_alone_tell_what_was_sent(patch: Patch) -> None:
    patch.setattr(opening, "_begun", lambda _: ())


def a_restart_sends_again(patch: Patch) -> None:
    def take_over(self: Moves, body: Body, move: Move, **how: Any) -> None:
        async def again() -> None:
            while body.line.state != "ready":  # noqa: ASYNC110  # no event
                await asyncio.sleep(0.1)
            command = COMMANDS[move.command].read(move.frame[6:].removesuffix("\\r"))
            with acting(Origin("client", move.request_id)), suppress(GatewayError):
                await body.line.submit(body.number, command, Lane.COMMAND)

        took(self, body, move, **how)
        self._see_through(move.id, again, asyncio.get_running_loop().create_future(), lambda _: None)

    took = Moves.take_over
    patch.setattr(Moves, "take_over", take_over)


def moves_are_forgotten(patch: Patch) -> None:
    patch.setattr("gateway.core.move_log.MoveLog.remember", _nothing)


def no_reply_means_not_sent(patch: Patch) -> None:
    def unusable(exchange: Exchange[Any, Any, Any], _kind: type[NoReply], what: str) -> NotSent:
        return NotSent(what)

    patch.setattr(Exchange, "unusable", unusable)


def a_reply_is_the_end_of_a_move(patch: Patch) -> None:
    async def follow(self: MoveRun[Any, Any], _doubt: NoReply | None = None) -> None:
        self.advance(MoveStatus.SUCCEEDED)

    patch.setattr(MoveRun, "follow", follow)


def frames_begin_in_each_other(patch: Patch) -> None:
    def send(self: LineDriver[Any, Any, Any], data: bytes, now: float) -> bool:
        sent: bool = done(self, data, now)
        self._wire.free_at = now
        return sent

    done = LineDriver._send
    patch.setattr(LineDriver, "_send", send)


def a_stop_needs_no_repetition(patch: Patch) -> None:
    patch.setattr("gateway.core.stops.Stopping._repeat", _nothing)


def refusals_of_bodies_are_believed(patch: Patch) -> None:
    patch.setattr(move_proof, "IN_MOTION", frozenset())


def refusals_of_robots_are_believed(patch: Patch) -> None:
    patch.setattr(moves_of_robots, "IN_MOTION", "")


def flash_at_any_time(patch: Patch) -> None:
    patch.setattr(Guards, "_flash_while_moving", _nothing)


def a_suspension_changes_nothing(patch: Patch) -> None:
    patch.setattr(LineDriver, "revoke", _nothing)


def requests_have_no_age(patch: Patch) -> None:
    patch.setattr(Admission, "require", _nothing)


def the_mark_always_stands(patch: Patch) -> None:
    patch.setattr(Mark, "stands", _true)


def half_commands_are_ended(patch: Patch) -> None:
    patch.setattr("gateway.rorze.session.HALF_COMMAND_ENDS", dict.fromkeys(HALF_COMMAND_ENDS, b"\r"))
    patch.setattr("gateway.fics.line.CLEARING", b"\rPOF 2\r")


def deadlines_follow_the_wall_clock(patch: Patch) -> None:
    def refuses(self: Gate[Any], exchange: Any, now: float) -> Any:
        return asked(self, exchange, time.time() - began)

    asked, began = Gate.refuses, 1.79e9
    patch.setattr(Gate, "refuses", refuses)


def keys_are_not_looked_up(patch: Patch) -> None:
    async def known(*_: Any) -> None:
        return

    patch.setattr(Keys, "known", known)


def stops_wait_for_the_disk(patch: Patch) -> None:
    patch.setattr(Intents, "must_come_first", lambda *_: True)


def endless_moves_need_no_permission(patch: Patch) -> None:
    patch.setattr(Moves, "require_end", _nothing)


def an_absence_is_a_loss_of_power(patch: Patch) -> None:
    async def find_mode(line: FicsLine) -> int | None:
        mode = await found(line)
        if line._known and line._was_away and mode == line.mode:
            line._lost_power()
        return mode

    found = FicsLine._find_mode
    patch.setattr(FicsLine, "_find_mode", find_mode)


def signs_of_power_are_not_looked_at(patch: Patch) -> None:
    patch.setattr(Conversation, "_see_signs", _true)


SWITCHES = (
    Switch("a doubt is settled by a fence before anything else is sent", no_fence, BODIES),
    Switch("a reply is credited to its body alone", any_body_answers, BODIES),
    Switch("what was admitted before a stop is not written after it", no_epoch, BODIES),
    Switch("nothing with an effect is repeated without being asked for", repeat_unasked),
    Switch("a stop is confirmed by standstill", stops_without_proof, BODIES),
    Switch("a stop of a robot is confirmed by standstill", stops_of_robots_without_proof, ROBOTS),
    Switch("what has an effect has an intent", no_intents),
    Switch("the intent comes before the first byte", intent_after_the_first_byte),
    Switch("an intent is durable, not only written", commits_are_not_synced),
    Switch("a crash begins a new epoch of events", a_crash_looks_clean),
    Switch("the numbers of events go on over restarts", numbers_begin_anew),
    Switch(
        "the intents tell what was sent, not the records alone",
        records_alone_tell_what_was_sent,
        range(30, 90),
    ),
    Switch("nothing is sent again after a restart", a_restart_sends_again, BODIES),
    Switch("moves outlive the gateway", moves_are_forgotten),
    Switch("silence is no refusal", no_reply_means_not_sent),
    Switch("a reply is not the end of a move", a_reply_is_the_end_of_a_move, BODIES),
    Switch("no frame begins in another", frames_begin_in_each_other),
    Switch("what was left half sent to a body is spoilt, not ended", half_commands_are_ended, BODIES),
    Switch("what was left half sent to a robot is spoilt, not ended", half_commands_are_ended, ROBOTS),
    Switch(
        "a line that was away is no loss of power",
        an_absence_is_a_loss_of_power,
        ROBOTS,
    ),
    Switch("no deadline follows the wall clock", deadlines_follow_the_wall_clock, by_replay=True),
)


class Told(NamedTuple):
    """One rule, switched off, and the story that has to notice."""

    rule: str
    off: Callable[[Patch], None]
    story: Callable[[Patch, Path], None]


robot_on_a_bad_wire = test_faulty_robot.test_what_is_believed_of_a_robot_on_a_bad_wire_is_true
read_after_a_suspension = (
    test_suspension.test_a_request_that_was_read_after_it_is_refused_for_nobody_knows_its_age
)

STORIES = (
    Told(
        "a doubt is settled by a fence on a robot's line, too",
        no_fence_of_robots,
        lambda patch, _: test_faulty_robot.test_what_is_believed_of_a_robot_on_a_bad_wire_is_true(
            2, 0, patch
        ),
    ),
    Told(
        "what a loss of power takes is looked at in Ver.2",
        signs_of_power_are_not_looked_at,
        lambda _, folder: test_cut_lines_of_robots.play(
            Case(Untouched, 2, "in a move", 0.3, power=False), folder
        ),
    ),
    Told(
        "a stop is repeated until it is confirmed",
        a_stop_needs_no_repetition,
        lambda *_: (
            test_stops.test_a_body_that_does_not_answer_is_unconfirmed_after_two_seconds_and_told_again()
        ),
    ),
    Told(
        "a motor that runs contradicts its refusal",
        refusals_of_bodies_are_believed,
        lambda *_: (
            test_move_proof.test_a_doubled_command_whose_first_copy_was_executed_is_not_called_rejected()
        ),
    ),
    Told(
        "axes that move contradict their refusal",
        refusals_of_robots_are_believed,
        lambda *_: test_move_runs.test_a_doubled_command_whose_first_copy_was_executed_is_not_called_rejected(
            3
        ),
    ),
    Told(
        "nothing is written to flash memory while a motor of the line moves",
        flash_at_any_time,
        lambda *_: test_plant.test_flash_waits_for_the_whole_line_to_stand_still(),
    ),
    Told(
        "a full disk is owed what it did not take",
        a_full_disk_forgets,
        lambda patch, folder: asyncio.run(
            test_journal.test_what_a_full_disk_has_not_taken_is_written_in_its_order_when_there_is_room(
                patch, folder
            )
        ),
    ),
    Told(
        "what waited while the gateway was suspended is not sent",
        a_suspension_changes_nothing,
        lambda *_: test_suspension.test_a_move_that_waits_for_the_line_does_not_begin_late(),
    ),
    Told(
        "a request that was read after a suspension is refused",
        requests_have_no_age,
        lambda *_: (
            test_suspension.test_a_request_that_was_read_after_it_is_refused_for_nobody_knows_its_age()
        ),
    ),
    Told(
        "a body that has lost its power is not sent to a place",
        the_mark_always_stands,
        lambda *_: test_body_power.test_the_mark_tells_on_boards_that_keep_their_position_too(True),
    ),
    Told(
        "a request is carried out once for each key",
        keys_are_not_looked_up,
        lambda _, folder: test_idempotent_requests.test_a_repeat_gets_the_same_answer(World(folder / "data")),
    ),
    Told(
        "a stop waits for no disk",
        stops_wait_for_the_disk,
        lambda *_: test_intents.test_a_stop_waits_for_no_disk_and_is_written_down_afterwards(),
    ),
    Told(
        "a move without an end needs the permission of the configuration",
        endless_moves_need_no_permission,
        lambda *_: test_moves.test_a_plan_of_an_endless_move_needs_the_permission_too(),
    ),
)
