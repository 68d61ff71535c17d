"""Density estimation on the tangent plane with NumPy and embreex; knows nothing of Blender."""
