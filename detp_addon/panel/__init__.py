"""The panel of the 3D View: properties, operators, and the bake that runs in slices while Blender stays alive."""
