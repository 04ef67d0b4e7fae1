"""The version of the tool, for those who write it into files: that of the installed distribution."""

from importlib.metadata import PackageNotFoundError, version

try:
    __version__ = version("ffc-id")
except PackageNotFoundError:  # the sources on the path, nothing installed
    __version__ = "0+unknown"
