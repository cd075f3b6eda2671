"""Tokens of leases only grow, over restarts too."""

import asyncio
from pathlib import Path

import pytest

from gateway.core.errors import NotSent
from gateway.core.lease_tokens import AHEAD, FILE, LeaseTokens


def given(tokens: LeaseTokens, count: int) -> list[int]:
    async def take() -> list[int]:
        return [await tokens.next() for _ in range(count)]

    return asyncio.run(take())


def test_each_number_is_given_once_by_whichever_life_of_the_gateway(tmp_path: Path) -> None:
    lives = [given(LeaseTokens(tmp_path), count) for count in (1, 3, AHEAD + 1, 2)]
    numbers = [number for life in lives for number in life]
    assert numbers == sorted(set(numbers))


def test_a_number_is_written_down_before_it_is_given(tmp_path: Path) -> None:
    (last,) = given(LeaseTokens(tmp_path), 1)
    assert int((tmp_path / FILE).read_text()) > last


def test_clients_at_once_get_numbers_of_their_own(tmp_path: Path) -> None:
    async def take() -> list[int]:
        tokens = LeaseTokens(tmp_path)
        return list(await asyncio.gather(*(tokens.next() for _ in range(50))))

    assert len(set(asyncio.run(take()))) == 50


def test_without_a_directory_they_begin_anew() -> None:
    assert given(LeaseTokens(), 3) == [1, 2, 3]


def test_what_cannot_be_written_down_is_not_given(tmp_path: Path) -> None:
    (tmp_path / FILE).write_text("no number")
    with pytest.raises(NotSent, match="cannot be written down"):
        given(LeaseTokens(tmp_path), 1)
