"""``detp tradeoff``: error against time on a scene, beside Cycles' own vertex bake."""
