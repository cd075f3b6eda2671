"""Several gateways as one plant: the registry, the stream of all events, and the process in front of all."""
