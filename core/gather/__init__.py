"""Gathering once over DETP's light: records where gather rays land, and the light that they reflect."""
