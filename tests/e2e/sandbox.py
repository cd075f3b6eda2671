"""Runs a program under what a unit forbids, as far as that goes here: `sandbox.py UNIT PROGRAM WORD...`.

System calls are refused, and code in memory that can be written.
"""

import ctypes
import ctypes.util
import errno
import os
import re
import subprocess
import sys
from pathlib import Path

ALLOW, REFUSE = 0x7FFF0000, 0x00050000 | errno.EPERM
"""Actions of libseccomp."""
NO_NEW_PRIVILEGES, NO_WRITABLE_CODE = 38, 65
"""Options of prctl(2); the second since Linux 6.3."""


def calls_of(name: str) -> set[str]:
    """The system calls of a set of systemd, such as @system-service."""
    if not name.startswith("@"):
        return {name}
    listed = subprocess.run(  # noqa: S603
        ["systemd-analyze", "--no-pager", "syscall-filter", name],  # noqa: S607
        check=True,
        capture_output=True,
        text=True,
    )
    lines = [line.strip() for line in listed.stdout.splitlines()[1:]]
    return set().union(*(calls_of(line) for line in lines if line and not line.startswith("#")))


def allowed(unit: str) -> set[str]:
    """System calls that `SystemCallFilter=` leaves: the first line allows, those with ~ take away."""
    calls = calls_of("@default")
    for taken, sets in re.findall(r"(?m)^SystemCallFilter=(~?)(.*)$", unit):
        named = set[str]().union(*map(calls_of, sets.split()))
        calls = calls - named if taken else calls | named
    return calls | calls_of("@default")


def confine(calls: set[str]) -> None:
    """Refuse this process, and all it becomes, every other system call with EPERM."""
    libc, seccomp = ctypes.CDLL(None), ctypes.CDLL(ctypes.util.find_library("seccomp"))
    libc.prctl(NO_NEW_PRIVILEGES, 1, 0, 0, 0)
    libc.prctl(NO_WRITABLE_CODE, 1, 0, 0, 0)
    seccomp.seccomp_init.restype = ctypes.c_void_p
    filter_ = ctypes.c_void_p(seccomp.seccomp_init(ctypes.c_uint32(REFUSE)))
    for call in sorted(calls):
        number = seccomp.seccomp_syscall_resolve_name(call.encode("ascii"))
        if number >= 0:  # others are of other machines
            assert seccomp.seccomp_rule_add(filter_, ctypes.c_uint32(ALLOW), number, 0) == 0
    assert seccomp.seccomp_load(filter_) == 0


if __name__ == "__main__":
    confine(allowed(Path(sys.argv[1]).read_text("utf-8")))
    try:
        os.setpriority(os.PRIO_PROCESS, 0, 5)  # of @resources
    except PermissionError:
        print("confined", file=sys.stderr, flush=True)
    os.execv(sys.argv[2], sys.argv[2:])  # noqa: S606
