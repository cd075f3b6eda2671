"""Step-outs found by the STALL sensor, from the slip to the all-clear (RC-420 manual 13.6.2)."""

from tests.simulator.rorze.bench import Bench


def test_a_slip_is_found_reported_and_cleared() -> None:
    bench = Bench()
    bench.sent("OLS 1000", "QSS 1", "01M")
    assert bench.until_end() == ("01M", 0)
    bench.sent("1+M 20000")
    assert bench.until_end() == ("1+M", 0)
    assert bench.send("QRD") == "0"
    bench.axis.world.slipped += bench.axis.settings.stall_interval // 2
    bench.sent("1+M 20000")
    assert bench.until_end() == ("1+M", 0x01)
    assert bench.send("QRD") == "1"
    assert bench.send("1+M 100") == "@52"
    bench.sent("9CS")
    assert (bench.send("9CD6"), bench.send("QRD")) == ("1", "1")
    bench.sent("QRS")
    assert (bench.send("9CD6"), bench.send("QRD")) == ("0", "0")
    bench.sent("1+M 100")
