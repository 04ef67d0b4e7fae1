"""The exported C on a simulated board: cycles per step, flash and RAM."""
