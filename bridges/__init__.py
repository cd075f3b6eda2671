"""Bridges to MQTT and OPC UA: processes of their own, and clients of the gateway's public API."""
