"""How each sample scene is made: shapes in NumPy, put on a stage in Blender."""
