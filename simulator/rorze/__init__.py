"""A simulated RC-400 link master with its RC-420 axis controllers."""

from simulator.rorze import acts as acts  # fills the table of actions
