"""Recordings of a plant: taken, exported, and replayed to a controller's side or a client's."""
