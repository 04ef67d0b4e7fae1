"""The axes, servos and boards that tests, studies and benchmarks share."""
