"""Scene files and outputs: what can be opened, and files that are whole or not there."""
