"""Formulas as MathML: well formed, every symbol and every word kept."""

from __future__ import annotations

import xml.etree.ElementTree as ET

import pytest

from idtool.effects import registry
from idtool.presentation.mathml import typeset


@pytest.mark.parametrize("name", registry.names())
def test_every_effect_s_formula_is_well_formed_and_loses_nothing(name: str) -> None:
    formula = registry.get(name).formula
    tree = ET.fromstring(f"<p>{typeset(formula)}</p>")
    assert tree.find(".//math") is not None
    kept = "".join("".join(tree.itertext()).split())
    spelt = formula.replace("-", "−").replace("_", "").replace("^", "")
    for word, sign in {
        **{"alpha": "α", "beta": "β", "delta": "δ", "kappa": "κ", "sigma": "σ", "phi": "φ", "tau": "τ"},
        **{"mu ": "μ ", "2 pi ": "2 π ", "xi": "ξ"},
    }.items():
        spelt = spelt.replace(word, sign)
    assert kept.replace("ω", "w") == "".join(spelt.split())


def test_subscripts_powers_and_words() -> None:
    assert typeset("sigma2") == "<math><msub><mi>σ</mi><mn>2</mn></msub></math>"
    assert "<msup><mo" in typeset("(w / ws)²")
    assert typeset("b, held") == "<math><mi>b</mi></math>, held"


def test_a_sentence_with_symbols_in_it() -> None:
    """Meanings of parameters: words with an apostrophe or a hyphen stay, a colon belongs to the words."""
    assert typeset("coefficient of T_2") == ("coefficient of <math><msub><mi>T</mi><mn>2</mn></msub></math>")
    ripple = typeset("n, waves per turn: sin(n q); on a linear axis per metre")
    assert ripple.startswith("<math><mi>n</mi></math>, waves per turn: <math><mi ")
    assert ripple.endswith("</math>; on a linear axis per metre")
    for words in ("time constant of the warm-up", "share of the bristle's torque"):
        assert "<math>" not in typeset(words)


def test_markup_in_a_formula_stays_text() -> None:
    assert "<script" not in typeset("<script>alert(1)</script> & so on")
