"""An effect, two rigs and a reader for ffc-id, from a package of its own (docs/extending.md)."""
