"""Light that moves: baked at key frames, played back in Blender, and as a texture for engines."""
