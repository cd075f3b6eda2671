"""The console: pages for the people at the machine, served at `/` and built from the folder `console`."""
