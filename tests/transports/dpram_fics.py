"""The Fics side of a dual-port RAM as a program: it checks what it takes, and is at times slow."""

import mmap
import sys
import time
from pathlib import Path
from random import Random

TO_FICS = b"to Fics"
FROM_FICS = b"from Fics"


def message(way: bytes, number: int) -> bytes:
    """The message of a number: of any length that fits, alike in nothing but its way."""
    rng = Random(b"%s %d" % (way, number))
    return b"%s %d %s\r" % (way, number, rng.randbytes(rng.randrange(118)).hex().encode())


def dawdle(rng: Random) -> None:
    """Let some time pass: mostly none, at times some, seldom more than the other side stays awake for."""
    chance = rng.random()
    if chance < 0.0005:
        time.sleep(rng.uniform(0.0, 0.005))
    elif chance < 0.02:
        time.sleep(rng.uniform(0.0, 0.0001))


def run(ram: mmap.mmap, count: int, rng: Random) -> None:
    """Take and give `count` messages.

    :raises AssertionError: one was lost, doubled or torn on its way here.
    """
    taken = given = 0
    while taken < count or given < count:
        if taken < count and ram[257] == 1:
            assert ram[258:512].rstrip(b"\0") == message(TO_FICS, taken), taken
            dawdle(rng)
            ram[257] = 0
            taken += 1
        if given < count and ram[512] == 0:
            data = message(FROM_FICS, given).ljust(255, b"\0")
            cut = rng.randrange(255)
            ram[513 : 513 + cut] = data[:cut]
            dawdle(rng)
            ram[513 + cut : 768] = data[cut:]
            ram[512] = 1
            given += 1
        dawdle(rng)


if __name__ == "__main__":
    with Path(sys.argv[1]).open("r+b") as file, mmap.mmap(file.fileno(), 768) as mapped:
        run(mapped, int(sys.argv[2]), Random(7))
