"""Indirect light: photons from the lights over reflections and refractions to their path segments."""
