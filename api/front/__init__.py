"""The front door: HTTP and WebSocket protocols with their bounds, and ready-made documents."""
