"""The version of the tool, for those who write it into files."""

__version__ = "0.2.0"
