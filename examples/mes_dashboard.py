"""A dashboard for a manufacturing execution system: `python examples/mes_dashboard.py http://127.0.0.1:8420`.

It keeps a row for each body and each robot's unit: what it does, how its moves have ended, how long it was
busy. Events tell all of it, and go on where they were after a lost connection. Ctrl-C ends it, and no motor.
"""

import sys
from collections import Counter
from dataclasses import dataclass, field
from datetime import datetime

from motion_gateway_client import Gateway, GatewayError
from motion_gateway_client.generated.types import Event, Move, RobotMove

CLEAR = "\x1b[H\x1b[2J"
TYPES = ["body.*", "robot.*", "line.*", "stream.gap"]
HEAD = f"{'axis':<16}{'state':<12}{'position':>12}{'good':>8}{'bad':>8}{'busy s':>10}"


@dataclass
class Row:
    """One body, or one unit of a robot."""

    state: str = ""
    position: str = ""
    ends: Counter[str] = field(default_factory=Counter)
    busy_s: float = 0.0

    def take(self, move: Move | RobotMove) -> None:
        """Take the news of a move."""
        self.state = move["status"]
        if isinstance(place := move["position"], dict):
            self.position = " ".join(f"{axis}{value:g}" for axis, value in place.items() if value is not None)
        elif place is not None:
            self.position = str(place)
        if move["ended_at"] and move["sent_at"]:
            self.ends[move["status"]] += 1
            began, ended = map(datetime.fromisoformat, (move["sent_at"], move["ended_at"]))
            self.busy_s += (ended - began).total_seconds()

    def text(self, address: str) -> str:
        """Write the row."""
        bad = self.ends.total() - (good := self.ends["succeeded"])
        return f"{address:<16}{self.state:<12}{self.position:>12}{good:>8}{bad:>8}{self.busy_s:>10.1f}"


class Board:
    """All rows, and the last alarms."""

    def __init__(self, gateway: Gateway) -> None:
        self.rows = {body["body_id"]: Row() for body in gateway.list_bodies()["bodies"]}
        self.alarms: list[str] = []

    def take(self, event: Event) -> None:
        """Take what has happened."""
        match event["type"]:
            case "body.move.started" | "body.move.succeeded" | "body.move.failed" | "body.move.stopped":
                self._take_move(event["data"])
            case "body.move.lost" | "body.move.unknown" | "robot.move.lost" | "robot.move.unknown":
                self._take_move(event["data"])
                self._alarm(event, "look at the motor before it moves again")
            case "robot.move.started" | "robot.move.succeeded" | "robot.move.failed" | "robot.move.stopped":
                self._take_move(event["data"])
            case "robot.error":
                self._alarm(event, event["data"]["en"])
            case "line.down":
                self._alarm(event, event["data"]["reason"])
            case "body.offline" | "body.power_cycled" | "robot.offline" | "robot.power_cycled" | "stream.gap":
                self._alarm(event, "")

    def text(self) -> str:
        """Write the board."""
        rows = [row.text(address) for address, row in sorted(self.rows.items())]
        return "\n".join([HEAD, *rows, "", *self.alarms])

    def _take_move(self, move: Move | RobotMove) -> None:
        self.rows.setdefault(move["body_id"], Row()).take(move)

    def _alarm(self, event: Event, words: str) -> None:
        alarm = f"{event['time']} {event['type']} {event['subject']} {words}".rstrip()
        self.alarms = [*self.alarms, alarm][-5:]


def main(url: str | None = None) -> None:
    """Show the board anew at each event."""
    with Gateway(url) as gateway:
        board = Board(gateway)
        print(board.text(), flush=True)
        for event in gateway.events(types=TYPES):
            board.take(event)
            print(CLEAR if sys.stdout.isatty() else "", board.text(), sep="", flush=True)


if __name__ == "__main__":
    try:
        main(*sys.argv[1:])
    except KeyboardInterrupt:
        pass
    except GatewayError as error:
        sys.exit(str(error))
