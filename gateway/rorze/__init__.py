"""RC-420 controllers behind an RC-400 link master: their line, bodies, groups, moves and stops."""
