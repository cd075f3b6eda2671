import pytest

from transports import create
from transports.addresses import SCHEMES, Address
from transports.serial_port import SerialPort
from transports.tcp import TcpPort


def test_a_serial_address_names_a_device_and_its_speed() -> None:
    port = create("serial:///dev/serial/by-id/usb-FTDI%20232?baud=38400")
    assert isinstance(port, SerialPort)
    assert port.address == "serial:///dev/serial/by-id/usb-FTDI%20232?baud=38400"
    assert port.byte_time_s == pytest.approx(10 / 38400)
    assert port._device == "/dev/serial/by-id/usb-FTDI 232"


def test_a_serial_port_runs_at_9600_unless_told_otherwise() -> None:
    port = create("serial:///dev/ttyUSB0")
    assert port.byte_time_s == pytest.approx(10 / 9600)
    assert not port.is_bridged


@pytest.mark.parametrize("address", ["tcp://192.168.0.7:4001", "tcp://moxa-2.plant:4001", "tcp://[::1]:4001"])
def test_a_tcp_address_names_a_host_and_a_port(address: str) -> None:
    port = create(address)
    assert isinstance(port, TcpPort)
    assert port._port == 4001
    assert port.byte_time_s == 0.0
    assert port.is_bridged


@pytest.mark.parametrize(
    ("address", "reason"),
    [
        ("", "must begin with one of serial://, tcp://"),
        ("/dev/ttyUSB0", "must begin with one of"),
        ("usb:///dev/ttyUSB0", "must begin with one of"),
        ("serial:/dev/ttyUSB0", "must begin with one of"),
        ("SERIAL:///dev/ttyUSB0", "must begin with one of"),
        (" serial:///dev/ttyUSB0", "a blank"),
        ("serial:///dev/tty\nUSB0", "control character"),
        ("serial:///dev/ttyＵSB0", "non-ASCII"),
        ("serial:///dev/tty%00USB0", "control character in its path"),
        ("dpram:///dev/uio0%1b", "control character in its path"),
        ("serial://ttyUSB0", "after three slashes"),
        ("serial://", "after three slashes"),
        ("serial:///", "after three slashes"),
        ("serial://me@/dev/ttyUSB0", "user name"),
        ("serial:///dev/ttyUSB0#1", "fragment"),
        ("serial:///dev/ttyUSB0?buad=9600", "unknown option 'buad'; allowed: baud"),
        ("serial:///dev/ttyUSB0?baud", "?name=value"),
        ("serial:///dev/ttyUSB0?baud=9600&baud=9600", "twice"),
        ("serial:///dev/ttyUSB0?baud=", "not ''"),
        ("serial:///dev/ttyUSB0?baud=fast", "whole number from 50 to 4000000, not 'fast'"),
        ("serial:///dev/ttyUSB0?baud=-9600", "not '-9600'"),
        ("serial:///dev/ttyUSB0?baud=9600.0", "not '9600.0'"),
        ("serial:///dev/ttyUSB0?baud=9_600", "not '9_600'"),
        ("serial:///dev/ttyUSB0?baud=%EF%BC%99600", "whole number"),
        ("serial:///dev/ttyUSB0?baud=49", "from 50"),
        ("serial:///dev/ttyUSB0?baud=4000001", "to 4000000"),
        ("serial:///dev/ttyUSB0?baud=" + "9" * 5000, "to 4000000"),
        ("tcp://", "tcp://host:port"),
        ("tcp://moxa", "tcp://host:port"),
        ("tcp://:4001", "tcp://host:port"),
        ("tcp://moxa:0", "port 1 to 65535"),
        ("tcp://moxa:65536", "is not a URL"),
        ("tcp://moxa:port", "is not a URL"),
        ("tcp://[::1:4001", "is not a URL"),
        ("tcp://moxa:4001/", "tcp://host:port"),
        ("tcp://moxa:4001?baud=9600", "unknown option 'baud'; allowed: none"),
    ],
)
def test_an_address_that_is_not_understood_is_refused_with_its_reason(address: str, reason: str) -> None:
    with pytest.raises(ValueError, match=r"^address ") as refusal:
        create(address)
    assert reason in str(refusal.value)


@pytest.mark.parametrize("scheme", SCHEMES)
def test_every_scheme_is_named_in_the_refusal_of_an_unknown_one(scheme: str) -> None:
    with pytest.raises(ValueError, match=f"{scheme}://"):
        Address.parse("gopher://moxa")
