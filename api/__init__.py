"""HTTP and WebSocket words for gateway deeds."""
