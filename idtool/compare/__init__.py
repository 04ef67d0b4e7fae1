"""Parameters beside parameters, and errors beside errors."""
