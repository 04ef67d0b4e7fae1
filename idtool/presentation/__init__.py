"""How numbers, names and figures look, wherever they are shown."""
