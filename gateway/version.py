"""The version of the gateway."""

VERSION = "0.2.0"
