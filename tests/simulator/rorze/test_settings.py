"""Factory settings and changes to them."""

import pytest

from simulator.rorze.settings import Flash, Settings, SpeedSet


def test_factory_settings_are_those_of_chapter_18() -> None:
    factory = Settings()
    assert (factory.overrun_factor, factory.search_retries, factory.origin_offset) == (2, 0, 10)
    assert factory.speeds[30] == SpeedSet(50, 50_000, 100_000, 50, 50)
    assert set(factory.speeds[:30]) == {SpeedSet()}
    assert (factory.stall_interval, factory.encoder_multiplier, factory.encoder_tolerance) == (2_048, 4, 128)
    assert (len(factory.noise_counts), len(factory.resolutions), len(factory.comments)) == (15, 10, 7)


def test_a_change_leaves_what_flash_holds_alone() -> None:
    flash = Flash()
    ram = flash.settings.with_speed(3, low=70).with_item("comments", 1, "hello")
    assert (ram.speeds[3].low, ram.comments[1]) == (70, "hello")
    assert flash.settings == Settings()


def test_only_tuples_have_items() -> None:
    with pytest.raises(TypeError):
        Settings().with_item("mode", 0, 1)
