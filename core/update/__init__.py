"""Bakes that can be updated: what a change of the scene touches is found anew, the rest is kept."""
