"""A formula that is written as a person types it, typeset with MathML: no network, no script.

    typeset("g(w) + mu |tau_load|")   # <math>...</math>, HTML

Words stay words; runs of symbols between them become one `<math>` each, so that a line can break at the
words. `w` is the angular velocity ω, as everywhere on the page.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from html import escape

_GREEK = {
    "alpha": "α",
    "beta": "β",
    "delta": "δ",
    "kappa": "κ",
    "mu": "μ",
    "phi": "φ",
    "pi": "π",
    "sigma": "σ",
    "tau": "τ",
    "xi": "ξ",
    "w": "ω",
}
_FUNCTIONS = ("exp", "sin", "cos", "sgn")
_SIGNS = {"-": "−", "*": "·"}
_POWERS = {"²": "2", "³": "3"}
#: A word with an apostrophe or a hyphen is one token: the latter is no minus.
_COMPOUND = r"[A-Za-z]{2,}(?:'s|(?:-[A-Za-z]{2,})+)"
_TOKEN = re.compile(rf"\s+|{_COMPOUND}|[A-Za-zα-ω]+(?:_(?:[A-Za-z]+|\d+)|\d+)?|\d+(?:\.\d+)?|\.\.\.|.")
_SYMBOL = re.compile(r"(?P<base>[A-Za-zα-ω]+?)(?:_(?P<below>[A-Za-z]+)|_?(?P<digits>\d+))?")


def typeset(formula: str) -> str:
    """HTML of a formula; what cannot be read as symbols is kept as text."""
    return "".join(
        f"<math>{''.join(parts)}</math>" if symbolic else "".join(parts)
        for symbolic, parts in _runs(_TOKEN.findall(formula))
    )


def _runs(tokens: list[str]) -> Iterator[tuple[bool, list[str]]]:
    """Neighbours of one kind together: symbols (as MathML) or words (as text)."""
    parts: list[str] = []
    symbolic, depth, bars = False, 0, 0
    space = ""
    for index, token in enumerate(tokens):
        if token.isspace():
            space = " "
            continue
        inside = depth > 0 or bars % 2 == 1
        word = _is_word(token, tokens[index + 1 :]) or (token in ",;:" and not inside)
        depth += (token == "(") - (token == ")")
        bars += token == "|"
        wanted = inside or not word
        if wanted != symbolic:
            if parts:
                yield symbolic, parts
                if space:
                    yield False, [space]
            symbolic, parts = wanted, []
        elif space:
            parts.append(' <mspace width="0.17em"/>' if wanted else " ")
        space = ""
        if not wanted:
            parts.append(escape(token))
        elif word:
            parts.append(f"<mtext>{escape(token)}\u00a0</mtext>")
        elif parts and (token in _POWERS or parts[-1] == "^"):
            if parts[-1] == "^":
                parts.pop()
            base = parts.pop() if parts else "<mi></mi>"
            power = f"<mn>{_POWERS[token]}</mn>" if token in _POWERS else _symbol(token)
            parts.append(f"<msup>{base}{power}</msup>")
        else:
            parts.append(token if token == "^" else _symbol(token))
    if parts:
        yield symbolic, parts


def _is_word(token: str, following: list[str]) -> bool:
    if re.fullmatch(_COMPOUND, token):
        return True
    if not token.isalpha() or token in _FUNCTIONS or token in _GREEK or _differential(token):
        return False
    if token == "a":  # the acceleration, unless a word comes next
        after = next((t for t in following if not t.isspace()), "")
        return len(after) > 1 and after.isalpha()
    return len(token) > 1 and not _subscripted(token)


def _subscripted(token: str) -> bool:
    """A Greek letter with a letter below it, as in τs."""
    return len(token) == 2 and token[0] in "αβδκμξπστφω" and token[1].isascii()


def _differential(token: str) -> bool:
    return len(token) == 2 and token[0] == "d" and token[1] in "tz"


def _symbol(token: str) -> str:
    if token in _FUNCTIONS:
        return f'<mi mathvariant="normal">{token}</mi>'
    if _differential(token):
        return f'<mi mathvariant="normal">d</mi><mi>{token[1]}</mi>'
    if token[0].isdigit():
        return f"<mn>{token}</mn>"
    if _subscripted(token):
        return f"<msub><mi>{token[0]}</mi><mi>{token[1]}</mi></msub>"
    match = _SYMBOL.fullmatch(token)
    if match is None:
        return f'<mo stretchy="false">{escape(_SIGNS.get(token, token))}</mo>'
    base = f"<mi>{_GREEK.get(match['base'], match['base'])}</mi>"
    if match["digits"]:
        return f"<msub>{base}<mn>{match['digits']}</mn></msub>"
    if not match["below"]:
        return base
    below = _GREEK.get(match["below"], match["below"])
    tag = "mi" if len(below) == 1 else "mtext"
    return f"<msub>{base}<{tag}>{below}</{tag}></msub>"
