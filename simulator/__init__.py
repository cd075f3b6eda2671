"""Fake controllers: pure state machines on given time, and the ports they are put behind."""
