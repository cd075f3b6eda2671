"""Alarms: faults told so that a technician can act on them, and kept until a person resets them.

An event raises an alarm by the table of causes. The plant itself is asked if the cause lasts; that is never
remembered. A cause that comes again after its end raises a new alarm in the place of the old one: a reset
means the alarm that was seen.
"""

from collections import OrderedDict
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from typing import Any, Final, Generic, NamedTuple, Self, TypeVar

from pydantic import Field

from gateway import texts
from gateway.core import numbers
from gateway.core.errors import GatewayError, NotFound
from gateway.core.events import Event, EventHub
from gateway.core.marks import DETAIL
from gateway.core.next_calls import ALARMS, NextCall, filled_in, get, post
from gateway.core.origin import current, new_id
from gateway.core.records import Record
from gateway.core.rights import Right
from gateway.texts import Text, text
from protocols.wording import as_given

HISTORY: Final = 1000
"""Alarms that are over and reset, and still kept; newer ones push them out."""
AGAIN: Final = "gateway: it came again"
"""`reset_by` of an alarm that a newer one has replaced."""
DISPROVED: Final = "gateway: disproved"
"""`reset_by` of an alarm that has ended itself, and is a note only: it was seen that it had no cause."""

Facts = Mapping[str, Any]
T = TypeVar("T")


class AlarmText(Record):
    """An alarm in one language."""

    happened: str = Field(description="The event, in words.")
    motor: str = Field(description="The motor's reaction, or what it may still do.")
    remedy: str = Field(description="The next step for the operator.")

    def of(self, facts: Facts, language: str) -> Self:
        """Fill in what is known of this one."""
        written = {name: _written(texts.spoken(fact, language)) for name, fact in facts.items()}
        told = {name: text.format_map(written).strip() for name, text in self.model_dump().items()}
        return self.model_copy(update=told)


def _written(fact: object) -> str:
    if isinstance(fact, list):
        return ", ".join(map(str, fact)) or "-"
    return "-" if fact is None else str(fact)


class PastWords(Record):
    """An alarm whose cause is over, in both languages: nothing of it is told as so now."""

    en: AlarmText
    ja: AlarmText

    def of(self, facts: Facts) -> Self:
        """Fill in what is known of this one."""
        return self.model_copy(update={"en": self.en.of(facts, "en"), "ja": self.ja.of(facts, "ja")})


class AlarmWords(NamedTuple):
    """An alarm as the catalogue has it."""

    en: AlarmText
    ja: AlarmText
    over: PastWords | None = None
    """Words of the alarm once it is over; None if the same words stay true."""


def words_of(key: str) -> AlarmWords:
    """Find the words of an alarm: `[alarms.KEY]` of each language, and `[alarms.KEY.over]`."""
    told = [texts.entry(language, f"alarms.{key}") for language in texts.LANGUAGES]
    en, ja = (
        AlarmText.model_validate({field: table[field] for field in AlarmText.model_fields}) for table in told
    )
    over = [AlarmText.model_validate(table["over"]) for table in told if "over" in table]
    return AlarmWords(en, ja, PastWords(en=over[0], ja=over[1]) if over else None)


class Alarm(Record):
    """A fault of the plant, from its time until a person has reset it."""

    id: str
    cause: str = Field(description="Kind of the alarm, such as `body.offline`; never changes.")
    number: int = Field(
        default_factory=lambda told: numbers.ALARMS.get(told["cause"], 0),
        description="The number of its cause, as `GET /numbers` has it; never changes.",
    )
    subject: str = Field(
        description="The part it is about, as in events: /bodies/line1.3F, /lines/line1, /gateway."
    )
    raised_at: datetime
    ended_at: datetime | None = Field(
        default=None, description="Time at which its cause was seen to be over; null while it lasts."
    )
    reset_at: datetime | None = Field(
        default=None, description="Time of the reset; null while the alarm stands."
    )
    reset_by: str | None = Field(
        default=None,
        description=f"Who has reset it; `{AGAIN}` where a newer one stands in its place, `{DISPROVED}` where "
        "it turned out to have had no cause.",
    )
    caller: str = Field(description="The caller in whose name the gateway worked when the alarm came.")
    request_id: str | None = Field(description="The X-Request-Id of that caller's request.")
    move_id: str | None = Field(default=None, description="Id of the move that it has ended, if any.")
    code: str | None = Field(default=None, description="The controller's own error code.")
    manual: str = Field(description="Section of the manual; empty if the alarm is not about a controller.")
    en: AlarmText
    ja: AlarmText
    when_over: PastWords | None = Field(
        default=None,
        description="Words of the alarm once its cause is over, in the place of `en` and `ja`; null if "
        "these stay true, or were replaced already.",
        json_schema_extra=DETAIL,
    )
    part_of: str | None = Field(
        default=None,
        description="The id of the standing alarm that tells the same event: of a failed move that of its "
        "cause, of a body that of its line, of several bodies that of the first. Events leave it out.",
    )
    next: list[NextCall] = Field(description="The calls that help, in the order in which they do.")


def _over(_subject: str) -> bool:
    return False


def _always(_data: Facts) -> bool:
    return True


def _as_told(data: Facts) -> Facts:
    return data


@dataclass(frozen=True)
class Cause:
    """A kind of alarms: the event that raises it, and what is told."""

    name: str
    event: str
    """The type of the event."""
    words: AlarmWords
    manual: str = ""
    next: Sequence[NextCall] = ()
    lasts: Callable[[str], bool] = _over
    """Says, by the subject, whether the cause lasts now. A cause that was only a moment is over at once."""
    applies: Callable[[Facts], bool] = _always
    """Says whether an event of the type means this cause."""
    facts: Callable[[Facts], Facts] = _as_told
    """Facts for the words, made of the event's data."""
    wanted: bool = False
    """True if a caller asked for it: it is an alarm only where alarms latch."""
    is_told: Callable[[str], bool] = _over
    """Says, by the subject, whether an alarm of something larger tells it, too; not where alarms latch."""
    latches: bool = True
    """True if it keeps its subject from moving, where alarms latch."""
    disproved: Callable[[str], bool] = _over
    """Asked when it is over, by the subject: has it turned out that there was no cause?"""


def _while_true_of(find: Callable[[str], T | None], holds: Callable[[T], bool]) -> Callable[[str], bool]:
    """Let a cause last while something is true of its subject, found by the last word of its path."""

    def lasts(subject: str) -> bool:
        found = find(subject.rpartition("/")[2])
        return found is not None and holds(found)

    return lasts


@dataclass(frozen=True)
class CauseKind(Generic[T]):
    """A cause as a table has it: of any line, body or robot. Its words stand in the catalogue."""

    name: str
    manual: str = ""
    next: Sequence[NextCall] = ()
    lasts: Callable[[T], bool] | None = None
    """Says of a target whether the cause lasts now; None if it was only a moment."""
    applies: Callable[[Facts], bool] = _always
    facts: Callable[[Facts], Facts] = _as_told
    event: str = ""
    """The type of the event, where that has another name."""
    wanted: bool = False
    is_told: Callable[[T], bool] | None = None
    """Says of a target whether an alarm of its line tells it, too."""
    latches: bool = True
    """True if it keeps its subject from moving, where alarms latch."""
    disproved: Callable[[T], bool] | None = None
    """Asked when it is over: has it turned out that there was no cause?"""
    words: str = ""
    """The key of its words, where that is not its name."""

    def among(self, find: Callable[[str], T | None]) -> Cause:
        """The cause of those that are found by their address; None is one that is configured no more."""
        return Cause(
            self.name,
            self.event or self.name,
            words_of(self.words or self.name),
            self.manual,
            self.next,
            _over if self.lasts is None else _while_true_of(find, self.lasts),
            self.applies,
            self.facts,
            self.wanted,
            _over if self.is_told is None else _while_true_of(find, self.is_told),
            self.latches,
            _over if self.disproved is None else _while_true_of(find, self.disproved),
        )


class AlarmLasts(GatewayError):
    """An alarm cannot be reset: its cause lasts, or has come again."""

    kind = "alarm-lasts"


class Latched(GatewayError):
    """An alarm keeps something from moving until it is reset."""

    kind = "latched"


class _Key(NamedTuple):
    subject: str
    cause: str


class Alarms:
    """The alarms of a plant."""

    def __init__(self, events: EventHub, causes: Iterable[Cause]) -> None:
        self._events = events
        self._by_event: dict[str, list[Cause]] = {}
        self._causes: dict[str, Cause] = {}
        for cause in causes:
            self._by_event.setdefault(cause.event, []).append(cause)
            self._causes[cause.name] = cause
        self._standing: dict[_Key, Alarm] = {}
        self._over: OrderedDict[str, Alarm] = OrderedDict()
        self.on_change: Callable[[Alarm], object] = lambda _: None
        """Called with an alarm that is new, or of which something more is known."""
        self.closed = False
        """The gateway ends: what happens now is wanted."""

    def resume(self, alarms: Iterable[Alarm]) -> None:
        """Take over the alarms of an earlier life, in their order."""
        for alarm in alarms:
            if alarm.reset_at is None:
                self._standing[_Key(alarm.subject, alarm.cause)] = alarm
            else:
                self._keep(alarm)

    @property
    def causes(self) -> Collection[str]:
        """The names of all causes that there can be."""
        return self._causes.keys()

    # raising

    def note(self, event: Event) -> None:
        """Raise what an event means; what it puts an end to is over before."""
        subject = "/".join(event.subject.split("/")[:3])  # of a unit's robot
        for alarm in [alarm for alarm in self._standing.values() if alarm.subject == subject]:
            self._note_end(alarm)
        if self.closed or event.type not in self._by_event:
            return
        data = event.data
        for cause in self._by_event[event.type]:
            if cause.applies(data) and not cause.is_told(subject):
                self._raise(cause, subject, data)

    def find(self, name: str, subject: str, **data: object) -> None:
        """Raise an alarm of which no event tells, if it does not stand yet."""
        if _Key(subject, name) not in self._standing and not self.closed:
            self._raise(self._causes[name], subject, data)

    def _raise(self, cause: Cause, subject: str, data: Facts) -> None:
        key = _Key(subject, cause.name)
        address = subject.rpartition("/")[2]
        facts = {"subject": subject, "address": address, **cause.facts(data)}
        before = self._standing.get(key)
        if before is not None:
            if before.ended_at is None and before.code == facts.get("code") and cause.lasts(subject):
                return
            self._reset(before, AGAIN)
        now = datetime.now(UTC)
        names = {**facts, "line": address.partition(".")[0]}
        alarm = Alarm(
            id=new_id(now),
            cause=cause.name,
            subject=subject,
            raised_at=now,
            ended_at=None if cause.lasts(subject) else now,
            caller=current().caller,
            request_id=facts.get("request_id") or current().request_id,
            move_id=facts.get("move_id"),
            code=facts.get("code"),
            manual=cause.manual,
            en=cause.words.en.of(facts, "en"),
            ja=cause.words.ja.of(facts, "ja"),
            next=filled_in(cause.next, names),
            when_over=cause.words.over and cause.words.over.of(facts),
        )
        _say_past(alarm)
        self._standing[key] = alarm
        self._tell("alarm.raised", alarm)

    def _tell(self, news: str, alarm: Alarm) -> None:
        self.on_change(alarm)
        self._events.publish(news, alarm.subject, alarm, alarm.id)

    # looking

    def note_ends(self) -> None:
        """Note which causes are over; what has turned out to have had none is reset."""
        for alarm in list(self._standing.values()):
            self._note_end(alarm)

    def _note_end(self, alarm: Alarm) -> None:
        cause = self._causes.get(alarm.cause)
        if alarm.ended_at is None and not (cause is not None and cause.lasts(alarm.subject)):
            alarm.ended_at = datetime.now(UTC)
            _say_past(alarm)
            if cause is not None and cause.disproved(alarm.subject):
                self._reset(alarm, DISPROVED)
            else:
                self.on_change(alarm)

    def standing(self) -> list[Alarm]:
        """Alarms that are not reset, newest first."""
        self.note_ends()
        return sorted(self._standing.values(), key=lambda alarm: alarm.id, reverse=True)

    def history(self) -> list[Alarm]:
        """Alarms that were reset, newest first."""
        return sorted(self._over.values(), key=lambda alarm: alarm.id, reverse=True)

    def get(self, alarm_id: str) -> Alarm:
        """Find an alarm.

        :raises NotFound: there is none, or it is no longer kept.
        """
        found = self._over.get(alarm_id)
        for alarm in list(self._standing.values()):
            if alarm.id == alarm_id:
                self._note_end(found := alarm)
        if found is None:
            detail = f"There is no alarm {as_given(alarm_id)}, or it is no longer kept."
            raise NotFound(detail, "GET /alarms lists them.", [ALARMS])
        return found

    # resetting

    def reset(self, alarm_id: str) -> Alarm:
        """Reset an alarm; nothing moves, and nothing is sent. Once more does no harm.

        :raises NotFound: there is none, or it is no longer kept.
        :raises AlarmLasts: its cause lasts, or has come again since.
        """
        alarm = self.get(alarm_id)
        if alarm.reset_by == AGAIN:
            raise AlarmLasts.worded("alarm.again", [ALARMS], cause=alarm.cause, subject=alarm.subject)
        if alarm.ended_at is None:
            happened, remedy = (
                Text(getattr(alarm.en, field), getattr(alarm.ja, field)) for field in ("happened", "remedy")
            )
            raise AlarmLasts.worded("alarm.lasts", alarm.next, happened=happened, remedy=remedy)
        if alarm.reset_at is None:
            self._reset(alarm, current().caller)
        return alarm

    def _reset(self, alarm: Alarm, by: str) -> None:
        alarm.reset_at, alarm.reset_by = datetime.now(UTC), by
        alarm.ended_at = alarm.ended_at or alarm.reset_at
        _say_past(alarm)
        del self._standing[_Key(alarm.subject, alarm.cause)]
        self._keep(alarm)
        self._tell("alarm.reset", alarm)

    def _keep(self, alarm: Alarm) -> None:
        self._over[alarm.id] = alarm
        while len(self._over) > HISTORY:
            self._over.popitem(last=False)

    # the latch

    def latched(self, addresses: Collection[str]) -> Latched | None:
        """Why these must not move: alarms about one of them stand."""
        standing = [alarm for alarm in self._standing.values() if self._latches(alarm)]
        found = [alarm for alarm in standing if alarm.subject.rpartition("/")[2] in addresses]
        if not found:
            return None
        names = ", ".join(f"{alarm.cause} at {alarm.subject} ({alarm.id})" for alarm in found)
        calls = [call for alarm in found for call in (*alarm.next, reset_of(alarm))]
        return Latched.worded("alarm.stands", calls, names=names)

    def _latches(self, alarm: Alarm) -> bool:
        cause = self._causes.get(alarm.cause)
        return cause is None or cause.latches


def _say_past(alarm: Alarm) -> None:
    """Tell nothing as so now of what is over."""
    if alarm.ended_at is not None and alarm.when_over is not None:
        told, alarm.when_over = alarm.when_over, None
        alarm.en, alarm.ja = told.en, told.ja


def reset_of(alarm: Alarm) -> NextCall:
    """The call that resets an alarm."""
    path = f"/alarms/{alarm.id}/reset"
    return post(path, Right.OPERATE, "reset-alarm")


# stops


def stopped(
    what: str, manual: str, next_calls: Sequence[NextCall], lasts: Callable[[T], bool]
) -> CauseKind[T]:
    """A stop that a person, or a program, has asked for; not one that ends a jog."""
    return CauseKind(
        f"{what}.stopped",
        manual,
        next_calls,
        lasts,
        lambda _: current().work == "clients",
        event=f"{what}.stop.requested",
        wanted=True,
        words="stopped",
    )


# moves

_LOOK: Final = "Read its status and position before anything else."


def causes_of_moves(what: str, manual: str, next_calls: Sequence[NextCall]) -> Iterator[Cause]:
    """The ways in which a move ends badly."""
    for how in ("failed", "lost", "unknown"):
        name = f"{what}.move.{how}"
        yield Cause(name, name, words_of(f"move.{how}"), manual, next_calls, facts=_facts_of_move)


def _ended_by(cause: str) -> Text:
    """Say what has ended a move: `ems+stop_command` names two causes, `error_001` an error of a robot."""
    said = []
    for word in cause.split("+"):
        kind, _, code = word.partition("error_")
        key = "ends.error" if code and not kind else f"ends.{word}"
        said.append(texts.text(key, code=code) if texts.has(key) else Text(word, word))
    return Text(" + ".join(sentence.en for sentence in said), "、".join(sentence.ja for sentence in said))


def _facts_of_move(record: Facts) -> Facts:
    error = record["error"] or {}
    return {
        "address": record["body_id"],
        "unit": record.get("unit"),
        "move_id": record["id"],
        "request_id": record["request_id"],
        "ended_by": _ended_by(record["end_cause"] or record["status"]),
        "detail": error.get("detail", ""),
        "remedy": error.get("remedy") or _LOOK,
        "code": error.get("controller_error"),
    }


RESTORE: Final = get("{subject}/restores/{restore_id}", "restore")


def causes_of_restores(what: str, manual: str) -> Iterator[Cause]:
    """The ways in which a restore of a body, a robot or a line ends badly."""
    for how in ("failed", "differs"):
        name = f"{what}.restore.{how}"
        yield Cause(name, name, words_of(f"restore.{how}"), manual, (RESTORE,), facts=_facts)


def _facts(record: Facts) -> Facts:
    return {
        "restore_id": record["id"],
        "request_id": record["request_id"],
        "detail": (record["error"] or {}).get("detail", ""),
    }


COMPARE: Final = post("{subject}/comparisons", Right.SETUP, "compare-last-night", nightly="last")


def facts_of_power_loss(loss: Facts) -> Facts:
    """Give the words that follow from its being `certain`."""
    how = "certain" if loss["certain"] else "likely"
    return {
        **loss,
        **{phrase: text(f"phrases.power-loss.{how}.{phrase}") for phrase in ("lost", "had_lost", "so")},
    }


def swapped(what: str, manual: str) -> CauseKind[Any]:
    """The alarm of a body or a robot that came back otherwise than it was: it may be another controller."""
    return CauseKind(f"{what}.swapped", manual, (COMPARE,), facts=_facts_of_swap, words="swapped")


def _facts_of_swap(swap: Facts) -> Facts:
    how = "certain" if swap["certain"] else "likely"
    return {**swap, "first": swap["told"][0], "who": text(f"phrases.swap.{how}")}
