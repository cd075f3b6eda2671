"""The parts that all routes share: problem details, strict requests, the ways a route reads and answers."""
