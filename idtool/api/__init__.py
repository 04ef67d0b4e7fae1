"""What `from idtool import ...` gives beyond single rooms: `identify` and its result."""
