"""Writes what was baked: colour attributes, their live preview, faces that lose light and their division."""
