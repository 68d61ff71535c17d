"""Values at vertices such that what faces show between them is the light that was found there."""
