"""Numbers that an option takes: finite ones. NaN passes every range, and no limit that it sets holds."""

from __future__ import annotations

import math
from typing import Any

import click


class _Finite(click.ParamType[float]):
    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> float:
        number = super().convert(value, param, ctx)
        if not math.isfinite(number):
            self.fail(f"{number} is no finite number", param, ctx)
        return float(number)


class Number(_Finite, click.types.FloatParamType):
    """Any finite number."""


class Tilt(Number):
    """One of the two angles of a tilt."""

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> float:
        try:
            return super().convert(value, param, ctx)
        except click.BadParameter as error:
            why = error.message.rstrip(".")
            self.fail(f"{why}; give both angles, ALPHA and BETA (30 0).", param, ctx)


class NumberRange(_Finite, click.FloatRange):
    """A finite number of a range."""


class Address(click.ParamType[tuple[str, int]]):
    """A host and a port."""

    name = "address"

    def convert(
        self, value: Any, param: click.Parameter | None, ctx: click.Context | None
    ) -> tuple[str, int]:
        host, _, port = str(value).rpartition(":")
        if not host or not port.isdecimal() or not 0 < int(port) < 2**16:
            self.fail(f"{value!r} is no HOST:PORT; give one, as 127.0.0.1:9870.", param, ctx)
        return host, int(port)


#: A finite number above zero.
POSITIVE = NumberRange(0.0, min_open=True)
