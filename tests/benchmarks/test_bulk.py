from benchmarks.bulk import exchanges
from transports.trace import Record, TraceKind


def test_halves_of_exchanges_are_not_counted() -> None:
    records = [
        _record(1, "rx", b">&009CDH00\r"),
        _record(2, "tx", b"&006PD\r"),
        _record(3, "rx", b">&006PD"),
        _record(4, "rx", b"+000000000\r"),
        _record(5, "tx", b"&009CD\r"),
    ]

    assert exchanges(records) == records[1:4]


def _record(at_ns: int, kind: TraceKind, data: bytes) -> Record:
    return 0, at_ns, kind, data, None, None
