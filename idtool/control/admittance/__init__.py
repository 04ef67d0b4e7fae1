"""The admittance law of mode "light"."""
