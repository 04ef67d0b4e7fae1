"""Axes of the simulated rig that a hand guides, each different from its file: what tests of the law push."""
