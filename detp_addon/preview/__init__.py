"""Pictures of baked scenes."""
