"""`python -m motion_gateway`."""

from motion_gateway import main

main()
