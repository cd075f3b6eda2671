"""What all families of controllers share: it knows none of them."""
