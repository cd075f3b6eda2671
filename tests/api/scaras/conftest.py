"""These tests are those of an extension: without its folder they have nothing to test."""

from gateway.families import EXTENSIONS

collect_ignore_glob = [] if EXTENSIONS else ["test_*.py"]
