"""The one log: a CSV file per experiment, TOML lines on top."""

from idtool.log.format import LOG_VERSION, columns_of, header_text
from idtool.log.log import Log
from idtool.log.writer import LogWriter

__all__ = ["LOG_VERSION", "Log", "LogWriter", "columns_of", "header_text"]
