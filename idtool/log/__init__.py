"""The one log: a CSV file per experiment, TOML lines on top."""

from idtool.log.log import LOG_VERSION, Log, LogWriter, columns_of, header_text

__all__ = [
    "LOG_VERSION",
    "Log",
    "LogWriter",
    "columns_of",
    "header_text",
]
