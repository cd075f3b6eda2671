"""The whole gateway against the simulators: a seed draws faults and crashes, and the history is judged."""
