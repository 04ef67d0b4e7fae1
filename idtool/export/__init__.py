"""A parameter file as other programs and boards read it."""
