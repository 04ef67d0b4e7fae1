"""XML files with remarks at their head."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence
from xml.etree import ElementTree as ET


def document(root: ET.Element, remarks: Sequence[str], *, declaration: bool = False) -> str:
    """The element as a file, indented, under its remarks as a comment."""
    ET.indent(root)
    head = '<?xml version="1.0"?>\n' if declaration else ""
    return f"{head}{_comment(remarks)}\n{ET.tostring(root, encoding='unicode')}\n"


def _comment(lines: Sequence[str]) -> str:
    """Lines as one comment, wrapped; two hyphens in a row, which XML forbids there, are parted."""
    text = []
    for line in lines:
        text += textwrap.wrap(line.replace("--", "- -"), 100, subsequent_indent="  ") or [""]
    return "\n".join(["<!--", *(f"  {line}".rstrip() for line in text), "-->"])
