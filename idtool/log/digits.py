"""Compiled reading of a table of decimal numbers, each rounded as `float` rounds it.

Up to 15 digits are a whole number that a float holds exactly, and so is a power of ten up to the 22nd: their
product or quotient is the nearest float (Clinger, How to read floating point numbers accurately, PLDI 1990).
A table with anything else in it is left to slower readers.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from idtool.model.jit import jit

_MOST_DIGITS = 15
#: As numbers: with text in it, compiled code loads all that numba knows of text.
_PLUS, _COMMA, _MINUS, _POINT, _ZERO, _NINE, _LINE, _E, _e = b"+,-.09\nEe"
_POWERS = np.array([10.0**power for power in range(23)])


def read_digits(rows: bytes, columns: int) -> NDArray[np.float64] | None:
    """The numbers of lines of so many fields, shape (columns, rows); None where one is not as told above."""
    table = np.empty((columns, rows.count(b"\n")))
    return table if _read(np.frombuffer(rows, np.uint8), _POWERS, table) else None


@jit()
def _read(text: NDArray[np.uint8], powers: NDArray[np.float64], table: NDArray[np.float64]) -> bool:
    columns, rows = table.shape
    at, column, row = 0, 0, 0
    while at < len(text):
        negative = text[at] == _MINUS
        if negative or text[at] == _PLUS:
            at += 1
        number, power, digits, significant, point = 0, 0, 0, 0, False
        while at < len(text):
            if _ZERO <= text[at] <= _NINE:
                number = 10 * number + text[at] - _ZERO
                digits += 1
                significant += significant > 0 or number > 0
                power -= point
                if significant > _MOST_DIGITS:
                    return False
            elif text[at] == _POINT and not point:
                point = True
            else:
                break
            at += 1
        if digits == 0:
            return False
        if at < len(text) and (text[at] == _e or text[at] == _E):
            at += 1
            below = at < len(text) and text[at] == _MINUS
            if below or (at < len(text) and text[at] == _PLUS):
                at += 1
            told, digits = 0, 0
            while at < len(text) and _ZERO <= text[at] <= _NINE and digits < 3:
                told, digits = 10 * told + text[at] - _ZERO, digits + 1
                at += 1
            if digits == 0:
                return False
            power += -told if below else told
        if at == len(text) or abs(power) >= len(powers):
            return False
        value = number * powers[power] if power >= 0 else number / powers[-power]
        if row == rows:
            return False
        table[column, row] = -value if negative else value
        last = column == columns - 1
        if text[at] != (_LINE if last else _COMMA):
            return False
        column, row = (0, row + 1) if last else (column + 1, row)
        at += 1
    return row == rows and column == 0
