"""A simulated Fics: units of axes behind C-HOST, macros, the pendant, and a line with faults."""
