"""The line of a record: written as the model writes it."""

from hypothesis import given
from hypothesis import strategies as st

from gateway.recordings import _trace_line
from transports.trace import TraceEntry, TraceKind

KINDS: st.SearchStrategy[TraceKind] = st.sampled_from(["rx", "tx", "opened", "lost", "closed"])
TIMES = st.integers(0, 4_000_000_000) | st.just(0)
TEXTS = st.none() | st.text(max_size=20)


@given(TIMES, st.integers(0, 999_999_999), st.integers(0, 2**62), KINDS, st.binary(max_size=20), TEXTS, TEXTS)
def test_a_record_is_written_as_its_model_writes_it(
    seconds: int,
    part: int,
    monotonic_ns: int,
    kind: TraceKind,
    data: bytes,
    caller: str | None,
    request: str | None,
) -> None:
    for at_ns in (seconds * 10**9 + part, seconds * 10**9):
        record = (at_ns, monotonic_ns, kind, data, caller, request)
        entry = TraceEntry.model_validate_json(_trace_line(record))
        assert entry == TraceEntry.of(record)
        assert _trace_line(record).decode() == TraceEntry.of(record).model_dump_json() + "\n"
