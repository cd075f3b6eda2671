"""Scans of ports over HTTP."""

from tests.api.stand import BODIES, Stand, on_stand


@on_stand({"arm": BODIES})
async def test_ports_are_scanned_and_the_record_stays(stand: Stand) -> None:
    begun = await stand.post("/system/scans?wait=20", {"ports": ["tcp://127.0.0.1:9"]})
    assert begun.status_code == 200
    scan = begun.json()
    assert begun.headers["location"] == f"/system/scans/{scan['id']}"
    assert (scan["status"], scan["found"]) == ("finished", [])
    assert scan["notes"] == ["tcp://127.0.0.1:9 was not opened: there is no such port."]
    for name in (scan["id"], "current"):
        assert (await stand.get(f"/system/scans/{name}")).json() == scan
    assert (await stand.get("/system/scans/none")).status_code == 404
    over = await stand.client.delete("/system/scans/current")
    assert (over.status_code, over.json()["detail"]) == (404, "No scan of ports is running.")


@on_stand({"arm": BODIES})
async def test_what_is_no_free_port_is_refused(stand: Stand) -> None:
    frames = len(stand.port.written)
    for ports in ([], [""], ["arm"], ["http://host"], ["tcp://127.0.0.1:1"], ["tcp://h:1"] * 17, None):
        assert (await stand.post("/system/scans", {"ports": ports})).status_code == 422, ports
    for port in ("/dev/tty\0S0", "/dev/tty\nS0", "serial:///dev/tty%00S0", "dpram:///dev/uio%00"):
        answer = await stand.post("/system/scans", {"ports": [port]})
        assert (answer.status_code, "control character" in answer.text) == (422, True), port
    assert len(stand.port.written) == frames


@on_stand()
async def test_serial_ports_are_listed(stand: Stand) -> None:
    answer = await stand.get("/system/ports")
    assert answer.status_code == 200
    assert isinstance(answer.json()["ports"], list)
