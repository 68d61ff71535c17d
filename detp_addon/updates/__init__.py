"""Bakes that are kept for updates, so that what changed since is found anew, and the rest stays."""
