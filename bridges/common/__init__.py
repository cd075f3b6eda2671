"""The gateway's side of every bridge, shared by all protocols.

A protocol is a `process.Kind`: the model of its file, made of `settings.BridgeFile`, and a function that
works on a `process.Host`:

- it gives each event of `host.feed.run(take)` on, and calls `host.position.reach(cursor)` when an event is
  delivered for good;
- it tells the documents of `host.mirror`, as `on_change` has them;
- it asks in the name of others by `host.callers`;
- it says of its own side whether it is connected, by `host.state`.
"""
