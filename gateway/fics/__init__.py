"""The gateway side of Fics robots: a robot with its units behind one port."""
