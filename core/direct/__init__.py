"""Direct light: shadow rays from the points to the lights, and where to aim them."""
