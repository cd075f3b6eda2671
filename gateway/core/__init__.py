"""The common part of all families of controllers; it knows none of them."""
