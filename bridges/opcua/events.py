"""Ends of moves as events, and alarms as conditions: each client hears them in its own language."""

import json
from collections.abc import Mapping
from datetime import datetime
from typing import Any, Final
from urllib.parse import quote, unquote

from asyncua import ua
from asyncua.common.event_objects import BaseEvent, OffNormalAlarm

from bridges.common.mirror import Document
from bridges.opcua.methods import Commands, Request, status_of
from bridges.opcua.nodes import Space, Type
from bridges.opcua.sessions import GUEST, LANGUAGES
from bridges.opcua.stack import PlantServer

MOVE_ENDED: Final = "MoveEndedEventType"
FIELDS: Final = (
    ("MoveId", Type.String, "id"),
    ("Address", Type.String, "body_id"),
    ("Kind", Type.String, "kind"),
    ("Status", Type.String, "status"),
    ("EndCause", Type.String, "end_cause"),
    ("StartPosition", Type.Double, "start_position"),
    ("TargetPosition", Type.Double, "target_position"),
    ("Position", Type.Double, "position"),
    ("CountedIn", Type.String, "counted_in"),
    ("RequestId", Type.String, "request_id"),
)
"""Fields of a move's end: types, and members of the record. Positions as the controller counts."""
MORE: Final = (
    ("Detail", Type.String),
    ("Remedy", Type.String),
    ("Record", Type.String),
    ("Cursor", Type.String),
)
"""Fields made from the record: sentences, the whole as JSON, and its place in the gateway's events."""
ENDS: Final = frozenset(("succeeded", "failed", "stopped", "rejected", "cancelled", "lost", "unknown"))
SEVERITIES: Final = {"succeeded": 100, "stopped": 300, "cancelled": 300, "rejected": 500}
"""Severities of OPC UA events (1 to 1000) by the status of a move; every other status is a fault."""
FAULT: Final = 700
ALARM_SEVERITY: Final = 800
OVER_SEVERITY: Final = 400
"""Severity of an alarm whose cause is over and that is not reset yet."""
WORDS: Final = {
    "en": {"active": "Active", "inactive": "Inactive", "enabled": "Enabled", "latched": "Latched",
           "unlatched": "Not latched", "acked": "Acknowledged", "ended": "Move {id} of {body_id}: {status}"},
    "ja": {"active": "発生中", "inactive": "解消", "enabled": "有効", "latched": "ラッチ中",
           "unlatched": "ラッチなし", "acked": "確認済み", "ended": "{body_id} の移動 {id}：{status}"},
}  # fmt: skip


class _Spoken:
    """A text in each language; a session gets its own."""

    def __init__(self, texts: Mapping[str, str]) -> None:
        self.texts = texts

    def said(self) -> ua.LocalizedText:
        guest = GUEST.get()
        language = guest.language if guest else LANGUAGES[0]
        return ua.LocalizedText(self.texts[language], language)


def _word(name: str) -> _Spoken:
    return _Spoken({language: words[name] for language, words in WORDS.items()})


class _Speaking:
    """An event whose texts are in the language of the session that it is told to."""

    data_types: dict[str, Any]
    address: str | None

    def to_event_fields(self, select_clauses: list[ua.SimpleAttributeOperand]) -> list[ua.Variant]:
        """Give the fields that a client wants, as variants; what there is not is null."""
        return [self._field(clause) for clause in select_clauses]

    def _field(self, clause: ua.SimpleAttributeOperand) -> ua.Variant:
        path = [name.Name for name in clause.BrowsePath or ()]
        name = "/".join(path) if path else ua.AttributeIds(clause.AttributeId).name
        value = getattr(self, name, None)
        if isinstance(value, _Spoken):
            return ua.Variant(value.said(), Type.LocalizedText)
        if value is None or name not in self.data_types:
            return ua.Variant(None, Type.Null)
        type_ = self.data_types[name]
        return ua.Variant(value, Type.DateTime if isinstance(type_, ua.NodeId) else type_)


class MoveEnded(_Speaking, BaseEvent):
    """The end of a move."""


class Alarm(_Speaking, OffNormalAlarm):
    """An alarm of the gateway."""


class Events:
    """Tells what has ended, and what has gone wrong."""

    def __init__(self, space: Space, server: PlantServer, commands: Commands) -> None:
        self._space, self._server, self._commands = space, server, commands
        self._type = ua.NodeId()
        self._standing: dict[str, Document] = {}
        """Alarms by their ids, as they were told last."""

    def load(self) -> None:
        """Add the type of a move's end, and bind the reset of alarms."""
        self._type = self._space.event_type(
            MOVE_ENDED, [*((name, type_) for name, type_, _ in FIELDS), *MORE]
        )
        bind = self._server.isession.add_method_callback
        for method in (ua.ObjectIds.AlarmConditionType_Reset, ua.ObjectIds.AlarmConditionType_Reset2):
            bind(ua.NodeId(method), self._reset)
        bind(ua.NodeId(ua.ObjectIds.AcknowledgeableConditionType_Acknowledge), self._acknowledge)

    async def tell_move(self, event: Mapping[str, Any]) -> None:
        """Tell the end of a move with all that the gateway knows of it."""
        move = event["data"]
        told = MoveEnded()
        told.EventType = self._type
        address = address_of(event["subject"])
        self._begin(told, address, event["time"], SEVERITIES.get(move["status"], FAULT), event["id"])
        error = move.get("error") or {}
        texts = {
            language: " ".join(
                (WORDS[language]["ended"].format(**move), *([error["detail"]] if error else []))
            )
            for language in LANGUAGES
        }
        told.Message = _Spoken(texts)
        for name, type_, key in FIELDS:
            value = move.get(key)
            simple = isinstance(value, str) if type_ == Type.String else isinstance(value, int | float)
            told.add_property(
                name, (float(value) if type_ == Type.Double else value) if simple else None, type_
            )
        made = (
            error.get("detail"),
            error.get("remedy"),
            json.dumps(move, ensure_ascii=False),
            event["cursor"],
        )
        for (name, type_), value in zip(MORE, made, strict=True):
            told.add_property(name, value, type_)
        await self._server.subscription_service.trigger_event(told)

    async def tell_alarm(self, id_: str, alarm: Document | None) -> None:
        """Tell an alarm that stands, or that it stands no more."""
        before = self._standing.pop(id_, None)
        if alarm is not None:
            self._standing[id_] = alarm
        known = alarm or before
        if known is None or (before and alarm and before["ended_at"] == alarm["ended_at"]):
            return
        name = f"alarm.{id_}"
        if not self._space.has(name):
            self._add_condition(name, known["cause"], address_of(known["subject"]))
        stands = alarm is not None
        await self._server.subscription_service.trigger_event(self._condition(name, known, stands=stands))
        if not stands:
            self._space.remove(name)

    def _add_condition(self, name: str, cause: str, address: str) -> None:
        """Add the node of a condition, lean: it is there to be named in calls."""
        source = self._space.id(address)
        if not self._space.has(address):
            source = ua.NodeId(ua.ObjectIds.Server)
        self._space.object(
            source,
            name,
            (cause, self._space.own),
            ua.NodeId(ua.ObjectIds.OffNormalAlarmType),
            name,
            reference=ua.ObjectIds.HasCondition,
        )

    def _condition(self, name: str, alarm: Document, *, stands: bool) -> Alarm:
        told = Alarm()
        address = address_of(alarm["subject"])
        over = alarm["ended_at"] is not None or not stands
        at = alarm["raised_at"]
        if over:
            at = alarm["ended_at"] or alarm["raised_at"]
        self._begin(told, address, at, OVER_SEVERITY if over else ALARM_SEVERITY, f"{name}/{at}/{stands}")
        told.add_property("NodeId", self._space.id(name), Type.NodeId)
        told.add_property("CauseNumber", alarm.get("number", 0), Type.UInt32)
        told.ConditionName = alarm["cause"]
        told.Message = _Spoken({language: _sentence(alarm, language, over=over) for language in LANGUAGES})
        told.ConditionClassId = ua.NodeId(ua.ObjectIds.SystemConditionClassType)
        told.ConditionClassName = ua.LocalizedText("SystemConditionClassType")
        told.BranchId = ua.NodeId()
        told.Retain = stands
        told.Quality = ua.StatusCode(ua.StatusCodes.Good)
        told.LastSeverity = told.Severity
        told.Comment = ua.LocalizedText("")
        told.ClientUserId = alarm.get("reset_by") or ""
        told.SuppressedOrShelved = False
        for state, is_so, words in (
            ("EnabledState", True, ("enabled", "enabled")),
            ("ActiveState", not over, ("active", "inactive")),
            ("LatchedState", stands, ("latched", "unlatched")),
            ("AckedState", True, ("acked", "acked")),
        ):
            setattr(told, state, _word(words[0] if is_so else words[1]))
            setattr(told, f"{state}/Id", is_so)
        return told

    def _begin(self, told: Any, address: str, time: str, severity: int, id_: str) -> None:
        source = self._space.id(address)
        whose = (self._space.address_of(source) or address).removesuffix("/")
        if not self._space.has(address):
            source = ua.NodeId(ua.ObjectIds.Server)
        told.emitting_node = ua.NodeId(ua.ObjectIds.Server)
        told.address = whose  # of the gateway itself, too: who sees a part of the plant does not see that
        told.EventId = id_.encode()
        told.SourceNode = source
        told.SourceName = address
        told.Time = told.ReceiveTime = datetime.fromisoformat(time)
        told.LocalTime = ua.TimeZoneDataType()
        told.Severity = severity

    async def _reset(self, condition: ua.NodeId, *_comment: ua.Variant) -> ua.CallMethodResult:
        """Have the gateway reset an alarm, in the name of the one who asks."""
        result = ua.CallMethodResult()
        name = str(condition.Identifier)
        if not name.startswith("alarm.") or not self._space.has(name):
            result.StatusCode = ua.StatusCode(ua.StatusCodes.BadNodeIdUnknown)
            return result
        id_ = quote(name.removeprefix("alarm."), safe="")
        answer = await self._commands.ask(Request(f"/alarms/{id_}/reset", None))
        result.StatusCode = ua.StatusCode(status_of(answer))
        return result

    async def _acknowledge(self, _condition: ua.NodeId, *_given: ua.Variant) -> ua.CallMethodResult:
        """Say that nothing waits to be acknowledged: what the gateway has is the reset."""
        result = ua.CallMethodResult()
        result.StatusCode = ua.StatusCode(ua.StatusCodes.BadConditionBranchAlreadyAcked)
        return result


def is_end(type_: str) -> bool:
    """Tell if an event is the end of a move."""
    kind, _, status = type_.rpartition(".")
    return status in ENDS and kind in ("body.move", "robot.move")


def address_of(subject: str) -> str:
    """Give the address of what an event or an alarm is about: a node has it, or `gateway`."""
    kind, _, rest = unquote(subject).removeprefix("/").partition("/")
    if not rest:
        return kind
    return rest.replace("/units/", ".")


def _sentence(alarm: Document, language: str, *, over: bool) -> str:
    texts = alarm[language]
    if over and alarm.get("when_over"):
        texts = alarm["when_over"][language]
    return " ".join(sentence for sentence in (texts["happened"], texts["motor"], texts["remedy"]) if sentence)
