"""Files and signals of the operating system: read whole or refused, written whole or not at all."""
