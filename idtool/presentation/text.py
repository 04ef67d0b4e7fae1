"""Numbers and names as a person reads them."""

from __future__ import annotations

import math

from idtool.effects import registry
from idtool.model.units import Units, is_linear

_SUPERSCRIPTS = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
#: Below this a p-value says more of the rounding of its distribution than of the data.
_SMALLEST_P = 1e-16
#: Where a key of a file is not the word of the field.
_FIELD_NAMES = {"static": "stiction", "order": "run order"}


def number(value: float | None, digits: int = 4) -> str:
    """A number with so many significant digits; powers of ten where it is very large or small.

    >>> number(0.08055), number(-1.234e-7, 2), number(None)
    ('0.08055', '−1.2 × 10⁻⁷', '–')
    """
    if value is None or not math.isfinite(value):
        return "–"
    if value != 0 and not 1e-4 <= abs(value) < 1e6:
        mantissa, _, exponent = f"{value:.{digits - 1}e}".partition("e")
        return f"{_minus(mantissa)} × {power(int(exponent))}"
    places = digits - 1 - (math.floor(math.log10(abs(value))) if value else 0)
    return _minus(f"{value:.{max(places, 0)}f}")


def uncertain(
    value: float, stderr: float | None, interval: tuple[float, float] | None
) -> tuple[str, str, str]:
    """Value, standard error and interval, cut where the standard error has its second digit.

    >>> uncertain(0.0805546, 0.000321, (0.07992, 0.08119))
    ('0.08055', '0.00032', '0.07992 to 0.08119')
    """
    if stderr is None or not math.isfinite(stderr) or stderr <= 0:
        span = "–" if interval is None else f"{number(interval[0])} to {number(interval[1])}"
        return number(value), "–", span
    places = 1 - math.floor(math.log10(stderr))

    def cut(x: float) -> str:
        # beyond six decimals or six digits before the point, powers of ten read better
        if not -2 <= places <= 7 or abs(x) >= 1e6:
            digits = 2 if x == 0 else math.floor(math.log10(abs(x))) + places + 1
            return number(x, min(max(digits, 2), 8))
        return _minus(f"{round(x, places):.{max(places, 0)}f}")

    span = "–" if interval is None else f"{cut(interval[0])} to {cut(interval[1])}"
    return cut(value), cut(stderr), span


def p_text(p_value: float | None) -> str:
    """A p-value: plain down to 0.001, then the power of ten.

    >>> p_text(0.0312), p_text(3e-9), p_text(0.0)
    ('0.031', '3 × 10⁻⁹', 'below 10⁻¹⁶')
    """
    if p_value is None or not math.isfinite(p_value):
        return "–"
    if p_value < _SMALLEST_P:
        return f"below {power(-16)}"
    if p_value < 1e-3:
        mantissa, _, exponent = f"{p_value:.0e}".partition("e")
        return f"{mantissa} × {power(int(exponent))}"
    return f"{p_value:.2g}"


def percent(share: float | None, digits: int = 0) -> str:
    """A share as a percentage.

    >>> percent(0.4137)
    '41 %'
    """
    if share is None or not math.isfinite(share):
        return "–"
    return _minus(f"{100.0 * share:.{digits}f} %")


def change(before: float | None, after: float | None) -> str:
    """By how much an error fell or rose.

    >>> change(0.0113, 0.0034), change(1.0, 1.0)
    ('−70 %', 'unchanged')
    """
    if before is None or after is None or not before > 0:
        return "–"
    ratio = after / before - 1.0
    if abs(ratio) < 0.005:
        return "unchanged"
    return ("+" if ratio > 0 else "") + percent(ratio)


def words(name: str) -> str:
    """A name of a file as words: "position_ripple" as "position ripple"."""
    return name.replace("_", " ")


def quantity(name: str) -> str:
    """A parameter or a logged quantity as the field calls it; its key in files stays what it is.

    >>> quantity("static"), quantity("order"), quantity("stribeck_velocity")
    ('stiction', 'run order', 'stribeck velocity')
    """
    return _FIELD_NAMES.get(name, words(name))


def meaning_on(kind: Units, meaning: str) -> str:
    """A meaning on an axis of this kind: of a force on a linear one, of nothing linear on a rotary one.

    >>> meaning_on("rotary", "waves per turn; on a linear axis per metre")
    'waves per turn'
    >>> meaning_on("linear", "constant torque")
    'constant force'
    """
    if is_linear(kind):
        return meaning.replace("torque", "force")
    return meaning.partition("; on a linear axis")[0]


def effect_title(name: str) -> str:
    """What an effect is called in a sentence; a name that the library lacks, as words."""
    if not registry.knows(name):
        return words(name)
    title = registry.get(name).title
    return title[:1].lower() + title[1:]


def listed(items: list[str], last: str = "and") -> str:
    """Items as a sentence lists them.

    >>> listed(["a", "b", "c"])
    'a, b and c'
    """
    if len(items) < 2:
        return "".join(items)
    return f"{', '.join(items[:-1])} {last} {items[-1]}"


def counted(count: int, one: str, many: str | None = None) -> str:
    """A count with its noun.

    >>> counted(1, "trial"), counted(3, "trial")
    ('1 trial', '3 trials')
    """
    return f"{count} {one if count == 1 else many or one + 's'}"


def _minus(text: str) -> str:
    return text.replace("-", "−")


def power(exponent: int) -> str:
    """A power of ten.

    >>> power(-3)
    '10⁻³'
    """
    return f"10{str(exponent).translate(_SUPERSCRIPTS)}"
