"""Reads Blender as a render sees it: objects, materials, lights, world, and where light is wanted."""
