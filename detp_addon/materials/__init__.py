"""Baked light in the scene's own materials: put there, found again, taken out."""
