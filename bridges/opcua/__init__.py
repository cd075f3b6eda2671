"""The bridge to OPC UA: a server whose nodes are the plant."""
