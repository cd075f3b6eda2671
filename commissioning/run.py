"""Walking the assumptions of one line: each trial in turn, as far as people allow."""

from collections.abc import Awaitable, Callable, Iterator, Mapping
from contextlib import suppress
from datetime import UTC, datetime
from importlib.metadata import version
from types import MappingProxyType
from typing import Any, Final

from commissioning import fics, fics_deeds, rorze, rorze_deeds
from commissioning.assumptions import Assumption, Level, of_family
from commissioning.bench import OUTAGE, Bench, Terms
from commissioning.conversation import Conversation
from commissioning.debts import Debts, DebtsUnreadable
from commissioning.findings import Finding, Result, Unanswered, cannot_tell
from commissioning.report import Measured, Outcome, Report, Setting
from transports import Transport, TransportLost, create

Tell = Callable[[int, int, str], None]
"""Called before each trial: its place, how many there are, and its slug."""

BENCHES: Final[Mapping[str, tuple[Callable[..., Bench], Mapping[str, Any]]]] = MappingProxyType(
    {"rorze": (rorze.RorzeBench, rorze_deeds.TRIALS), "fics": (fics.FicsBench, fics_deeds.TRIALS)}
)
STUCK_MS: Final = 10_000
"""Longest time in ms for which a message may wait in the dual-port RAM while that is measured."""
ECHO: Final = "echo"
MAY_MOVE: Final = (
    " A motor that was to move may go on as far as the place that was named: look, and use the hardware stop."
)
AFTER_A_SURPRISE: Final = "See to {slug} first: change what is proposed, or find out why it is so."
AFTER_A_KILL: Final = "Let it be set back first what a commissioning before has left: `--allow settings`."


async def commission(
    line: Any,
    terms: Terms,
    debts: Debts | None = None,
    *,
    tell: Tell = lambda *_: None,
    open_transport: Callable[[str], Transport] = create,
) -> Report:
    """Try all assumptions about a line, alone on its port.

    :param debts: where it is written down what has to be set back.
    :raises TransportUnavailable: the port cannot be opened; nothing was sent.
    :raises DebtsUnreadable: it is not known what has to be set back; nothing was sent.
    """
    bench_of, trials = BENCHES[line.protocol]
    talk = Conversation(open_transport(patient(line.address)))
    bench = bench_of(line, talk, terms)
    bench.debts = debts or bench.debts
    try:
        bench.left()
    except (OSError, ValueError) as error:
        raise DebtsUnreadable(f"{bench.debts.file} cannot be read: {error}") from error
    await talk.open()
    started = _now()
    try:
        results, lost = await _walk(bench, trials, tell)
        if lost is None:
            await bench.describe()
    finally:
        await talk.close()
    return Report(
        version=version("motion-gateway"),
        line=line.id,
        protocol=line.protocol,
        address=line.address,
        started_at=started,
        ended_at=_now(),
        allowed=sorted(terms.allowed),
        controllers=bench.serial_numbers,
        table=line.model_dump(mode="json"),
        results=results,
        left=bench.left(),
        lost=lost,
        measured=Measured(
            replies_s=[round(time_s, 6) for time_s in bench.times],
            copies_s=[round(time_s, 6) for time_s in bench.copies],
        ),
        frames=talk.frames,
    )


async def ask_only(line: Any, open_transport: Callable[[str], Transport], tell: Tell) -> dict[str, Any]:
    """Try all that questions show, for a gateway that has lent the port; gives the report as JSON."""
    report = await commission(line, Terms(), tell=tell, open_transport=open_transport)
    return report.model_dump(mode="json")


def patient(address: str) -> str:
    """Give an address at which a robot may take its time to fetch a message from its dual-port RAM."""
    return fics.with_option(address, "stuck_ms", STUCK_MS) if address.startswith("dpram:") else address


async def _walk(bench: Bench, trials: Mapping[str, Any], tell: Tell) -> tuple[list[Outcome], str | None]:
    """Try each row, questions first and the power last; the results stand in the order of the rows.

    Why the port has gone meanwhile stands beside them: what was not tried by then cannot be told.
    """
    rows = of_family(bench.line.protocol)
    by_level = sorted(rows, key=lambda row: (row.person, list(Level).index(row.level)))
    found: dict[str, Finding] = {}
    lost: str | None = None
    barred: dict[Level, str] = {}
    """The step that a level needs before anything more is asked, set or moved."""
    with suppress(TransportLost):
        await bench.pay_all()
    if bench.left():
        barred = {Level.SETTINGS: AFTER_A_KILL, Level.MOTION: AFTER_A_KILL}
    for place, row in enumerate(by_level, 1):
        tell(place, len(rows), row.slug)
        is_over = row.person and OUTAGE in bench.memory  # several trials look at one loss of power
        is_due = row.level is Level.QUESTIONS or row.level in bench.terms.allowed
        if row.level in barred and is_due and not is_over:
            found[row.slug] = cannot_tell(row, "It was not tried.", barred[row.level])
            continue
        try:
            finding = found[row.slug] = await _try(row, bench, trials.get(row.slug))
        except TransportLost as error:
            lost = f"{error}{MAY_MOVE if row.level is Level.MOTION else ''}"
            break
        for level in _bars(row, finding):
            barred.setdefault(level, AFTER_A_SURPRISE.format(slug=row.slug))
    for row in rows:
        found.setdefault(row.slug, cannot_tell(row, "It was not tried: the port has gone."))
    return [outcome for row in rows for outcome in _outcomes(row, found[row.slug], bench.line)], lost


def _bars(row: Assumption, finding: Finding) -> tuple[Level, ...]:
    """Give the levels of trials that are left out after this one.

    After a surprise only questions are left, after a change no motion, and among echoes nothing: an echo
    would be taken for an answer.
    """
    if finding.surprise and row.slug == ECHO:
        return tuple(Level)
    if finding.surprise:
        return Level.SETTINGS, Level.MOTION
    return (Level.MOTION,) if finding.changes else ()


async def _try(
    row: Assumption, bench: Bench, trial: Callable[[Assumption, Bench], Awaitable[Finding]] | None
) -> Finding:
    if trial is None:
        return cannot_tell(row, row.probe)
    if row.level is not Level.QUESTIONS and row.level not in bench.terms.allowed:
        return cannot_tell(row, f"Only questions were asked: it takes `--allow {row.level}`.")
    try:
        finding = await trial(row, bench)
        is_false = finding.result in (Result.DIFFERS, Result.CONTRADICTS) and not row.harmless
        if is_false and row.level is not Level.MOTION and not row.person:
            finding = await trial(row, bench)  # an answer may have been lost, once
    except Unanswered as error:
        return cannot_tell(row, str(error), "Repeat it.")
    return finding


def _outcomes(row: Assumption, finding: Finding, line: Any) -> Iterator[Outcome]:
    """The result of a trial: once, or for each of several settings that it proposes."""
    table = line.model_dump(mode="json")
    proposed = {change.key: change.proposed for change in finding.changes} or {row.key: None}
    needed = finding.needed if finding.result is Result.CANNOT_TELL else None
    for key, value in proposed.items():
        held = bool(key) and "{" not in key
        setting = Setting(key=key, now=value_at(table, key), proposed=value) if held else None
        yield Outcome(
            assumption=row.slug, result=finding.result, setting=setting, needed=needed, seen=finding.seen
        )


def value_at(table: Any, key: str) -> Any:
    """The value of a table at a dotted key; tables in arrays are found by their ids."""
    for part in key.split("."):
        in_array = isinstance(table, list)
        table = next(entry for entry in table if entry["id"] == part) if in_array else table[part]
    return table


def _now() -> str:
    return datetime.now(UTC).isoformat(timespec="milliseconds").replace("+00:00", "Z")
