"""An invented family of controllers: one axis on a line, commanded in words."""
