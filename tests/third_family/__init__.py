"""A family of controllers that nobody sells: one axis on a line, commanded in words."""
