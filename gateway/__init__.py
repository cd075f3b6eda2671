"""The service core: lines, scheduling, moves, groups, events."""
