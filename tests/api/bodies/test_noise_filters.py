"""The noise filters of a body as one document over HTTP."""

from tests.api.bodies.test_speed_sets import set_by
from tests.api.stand import Stand, on_stand

PATH = "/bodies/01/noise-filters"


@on_stand()
async def test_the_filters_of_all_inputs_are_one_document(stand: Stand) -> None:
    seen = await stand.get(PATH)
    told = seen.json()
    assert (told["body_id"], set(told["noise_filters"].values())) == ("arm.01", {1})
    assert "ems" in told["noise_filters"]
    assert "d8" not in told["noise_filters"]
    changed = await stand.client.patch(PATH, json={"noise_filters": {"d3": 5, "ems": 1}})
    assert changed.status_code == 200, changed.text
    assert changed.json()["settings"]["noise_filters"]["d3"] == 5
    assert set_by(stand.frames()) == ["DCS3,5"]
    assert (await stand.get(PATH)).json()["noise_filters"]["d3"] == 5


@on_stand()
async def test_what_was_read_is_sent_back_and_what_has_changed_since_is_refused(stand: Stand) -> None:
    seen = await stand.get(PATH)
    back = await stand.client.patch(PATH, json=seen.json(), headers={"If-Match": seen.headers["etag"]})
    assert (back.status_code, set_by(stand.frames())) == (200, [])
    await stand.client.patch(PATH, json={"noise_filters": {"d3": 7}})
    late = await stand.client.patch(
        PATH, json={"noise_filters": {"d3": 9}}, headers={"If-Match": seen.headers["etag"]}
    )
    assert late.status_code == 412
    assert (await stand.client.patch(PATH, json={"noise_filters": {"d3": 0}})).status_code == 422
