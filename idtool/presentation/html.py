"""Pages that hold everything they show: their template, and pictures inside them."""

from __future__ import annotations

import base64
import struct
from importlib.resources import files
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from jinja2 import Environment


def environment() -> Environment:
    """Where the template of a page is read: all that goes into it is escaped, and nothing may be missing."""
    import jinja2

    return jinja2.Environment(
        autoescape=True, undefined=jinja2.StrictUndefined, trim_blocks=True, lstrip_blocks=True
    )


def resource(package: str, name: str) -> str:
    """A text that comes with a package: a template, a style, a script."""
    return files(package).joinpath(name).read_text("utf-8")


def embedded(png: bytes) -> tuple[str, int, int]:
    """A picture as a data address, its width and its height in pixels."""
    width, height = struct.unpack(">II", png[16:24])  # where a PNG keeps its size
    return "data:image/png;base64," + base64.b64encode(png).decode("ascii"), width, height
