"""What a parameter file is turned into for use elsewhere."""
