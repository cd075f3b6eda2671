"""Lists of the whole plant, made of those of its gateways; what an unheard gateway told is called old."""

import asyncio
from collections.abc import Mapping, Sequence
from time import monotonic
from typing import Any, Final

import httpx
from prometheus_client.parser import text_string_to_metric_families

from fleet.addresses import outward
from fleet.registry import Gateway, Registry
from fleet.upstream import WITHIN_S, Caller, Upstream
from gateway.core.errors import GatewayError

LISTS: Final = ("bodies", "robots", "lines", "alarms", "groups", "scaras", "leases")
MOST_KEPT: Final = 2000
"""Answers that are kept, of all callers together, for when a gateway is not heard."""
_IDS: Final = ("body_id", "robot_id", "line_id", "id", "group_id", "scara_id", "lease")
_OWN_METRICS: Final = ("process_", "python_")


class Refused(Exception):
    """Every gateway that has answered refuses; the answer of the first is that of the plant."""

    def __init__(self, answer: httpx.Response) -> None:
        super().__init__(f"status {answer.status_code}")
        self.answer = answer


class Merged:
    """Asks all gateways with the caller's key."""

    def __init__(self, registry: Registry, upstream: Upstream) -> None:
        self._registry, self._upstream = registry, upstream
        self._last: dict[tuple[str, str, str], tuple[float, Any]] = {}

    async def listed(self, what: str, query: str, caller: Caller) -> dict[str, Any]:
        """Give one of `LISTS`; for a gateway that does not answer, its last answer to this caller is used.

        Such an item has no state of its own any more: `unheard` is true, `heard_age_s` its age, and what the
        gateway told then stands in `last_known`.

        :raises Refused: no gateway lets this caller see it.
        """
        path = f"/{what}{f'?{query}' if query else ''}"
        gateways = self._registry.all()
        answers = await asyncio.gather(*(self._ask(gateway, path, caller) for gateway in gateways))
        items: list[Any] = []
        told = []
        refusals = []
        for gateway, answer in zip(gateways, answers, strict=True):
            state = "answered"
            if answer is None:
                state = "unheard"
                items += self._last_known(gateway, path, caller, what)
            elif answer.is_success:
                items += self._items(gateway, path, caller, answer.json()[what])
            else:
                state = "refused"
                refusals.append(answer)
            told.append({"gateway": gateway.name, "state": state})
        if refusals and len(refusals) == sum(answer is not None for answer in answers):
            raise Refused(refusals[0])
        return {what: _newest_first(items) if what == "alarms" else items, "gateways": told}

    async def _ask(self, gateway: Gateway, path: str, caller: Caller) -> httpx.Response | None:
        try:
            return await self._upstream.ask(gateway, "GET", path, caller.headers, within_s=WITHIN_S)
        except GatewayError:
            return None

    def _items(self, gateway: Gateway, path: str, caller: Caller, items: Sequence[Any]) -> list[Any]:
        told = [_item(gateway.name, item) for item in items]
        while len(self._last) >= MOST_KEPT:
            del self._last[next(iter(self._last))]
        key = gateway.name, path, caller.id
        self._last.pop(key, None)
        self._last[key] = monotonic(), told
        return [{**item, "unheard": False} for item in told]

    def _last_known(self, gateway: Gateway, path: str, caller: Caller, what: str) -> list[Any]:
        at, items = self._last.get((gateway.name, path, caller.id), (0.0, ()))
        if what == "alarms":  # they stand until somebody resets them, heard or not
            return [{**item, "unheard": True, "heard_age_s": round(monotonic() - at, 3)} for item in items]
        return [
            {
                **{name: item[name] for name in (*_IDS, "name", "gateway") if name in item},
                "unheard": True,
                "heard_age_s": round(monotonic() - at, 3),
                "last_known": item,
            }
            for item in items
        ]

    async def metrics(self, caller: Caller) -> str:
        """Sum the figures of all gateways that answer; those of lines stand with the gateway's name.

        :raises Refused: no gateway lets this caller see them.
        """
        gateways = self._registry.all()
        answers = await asyncio.gather(*(self._ask(gateway, "/metrics", caller) for gateway in gateways))
        good = {
            gateway.name: answer.text
            for gateway, answer in zip(gateways, answers, strict=True)
            if answer is not None and answer.is_success
        }
        refusals = [answer for answer in answers if answer is not None and not answer.is_success]
        if refusals and not good:
            raise Refused(refusals[0])
        own = [
            (gateway.name, self._registry.is_online(gateway), self._registry.age_s(gateway))
            for gateway in gateways
        ]
        return await asyncio.to_thread(_summed, good, own)


def _item(gateway: str, item: Mapping[str, Any]) -> dict[str, Any]:
    told = dict(outward(gateway, item))
    if "cause" in item:  # an alarm
        told["id"] = f"{gateway}:{item['id']}"
    return {**told, "gateway": gateway}


def _newest_first(alarms: list[Any]) -> list[Any]:
    """Sort alarms as a gateway does: those that stand first, each part newest first."""
    newest = sorted(alarms, key=lambda alarm: str(alarm["raised_at"]), reverse=True)
    return sorted(newest, key=lambda alarm: alarm.get("reset_at") is not None)


def _summed(texts: Mapping[str, str], own: Sequence[tuple[str, bool, float | None]]) -> str:
    """Write the sums in the text format of Prometheus."""
    sums: dict[str, dict[tuple[str, tuple[tuple[str, str], ...]], float]] = {}
    heads: dict[str, str] = {}
    for gateway, text in texts.items():
        for family in text_string_to_metric_families(text):
            if family.name.startswith(_OWN_METRICS):
                continue
            suffix = "_total" if family.type == "counter" else ""
            name = f"{family.name}{suffix}"
            kind = "gauge" if family.type in ("info", "unknown") else family.type
            heads[name] = f"# HELP {name} {family.documentation}\n# TYPE {name} {kind}\n"
            found = sums.setdefault(name, {})
            for sample in family.samples:
                labels = dict(sample.labels)
                if "line" in labels:
                    labels["line"] = f"{gateway}:{labels['line']}"
                key = sample.name, tuple(sorted(labels.items()))
                found[key] = found.get(key, 0.0) + sample.value
    rows = [
        f"{heads[name]}{''.join(_row(name, labels, value) for (name, labels), value in found.items())}"
        for name, found in sums.items()
    ]
    return "".join([*rows, *_of_gateways(own)])


def _row(name: str, labels: Sequence[tuple[str, str]], value: float) -> str:
    written = ",".join(f'{label}="{_escaped(text)}"' for label, text in labels)
    return f"{name}{{{written}}} {value}\n" if written else f"{name} {value}\n"


def _escaped(text: str) -> str:
    return text.replace("\\", "\\\\").replace('"', '\\"').replace("\n", "\\n")


def _of_gateways(own: Sequence[tuple[str, bool, float | None]]) -> list[str]:
    return [
        "# HELP motion_plant_gateway_online Whether a gateway was heard within 10 s.\n"
        "# TYPE motion_plant_gateway_online gauge\n",
        *(f'motion_plant_gateway_online{{gateway="{name}"}} {float(online)}\n' for name, online, _ in own),
        "# HELP motion_plant_gateway_heard_age_seconds For how long a gateway was not heard.\n"
        "# TYPE motion_plant_gateway_heard_age_seconds gauge\n",
        *(
            f'motion_plant_gateway_heard_age_seconds{{gateway="{name}"}} {age_s:.3f}\n'
            for name, _, age_s in own
            if age_s is not None
        ),
    ]
