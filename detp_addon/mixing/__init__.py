"""Light by its sources: which light groups a scene has, a bake of each, and their mixture."""
