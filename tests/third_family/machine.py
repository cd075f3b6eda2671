"""The simulated toy axis."""

from tests.third_family.rows import ROWS


class ToyMachine:
    """An axis that moves evenly; it answers each line at once."""

    def __init__(self) -> None:
        self.heard: list[str] = []
        self.mute = False
        """Whether it hears without answering."""
        self._speed = 10
        self._from = self._to = 0
        self._began_at = self._ends_at = 0.0
        self._output = b""

    def place(self, now: float) -> int:
        """Where the axis is."""
        if now >= self._ends_at:
            return self._to
        share = (now - self._began_at) / (self._ends_at - self._began_at)
        return round(self._from + share * (self._to - self._from))

    def receive(self, data: bytes, now: float) -> None:
        for line in data.decode("ascii").split("\r")[:-1]:
            self.heard.append(line)
            answer = self._answer(line, now)
            if not self.mute:
                self._output += f"{answer}\r".encode("ascii")

    def _answer(self, line: str, now: float) -> str:
        code, _, text = line.partition(" ")
        place, moves = self.place(now), now < self._ends_at
        if code not in {row.code for row in ROWS} or (code in ("GO", "SP") and moves):
            return f"{code} no"
        if code == "SP":
            self._speed = int(text)
        if code in ("GO", "HT"):
            self._from, self._to = place, int(text) if code == "GO" else place
            self._began_at, self._ends_at = now, now + abs(self._to - place) / self._speed
        told = {"PL": f"{place} {int(moves)}", "EC": text}.get(code, "")
        return f"{code} {told}".rstrip()

    def take_output(self, now: float) -> bytes:
        output, self._output = self._output, b""
        return output

    def wake_at(self) -> float | None:
        return None
