"""Whether to trust a result, check by check."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest

from idtool.parameters import Parameter, Parameters
from idtool.report import verdict


def parameters_check(static: dict[str, Parameter]) -> verdict.Check:
    evidence: Any = SimpleNamespace(parameters=Parameters(static=static))
    return verdict._parameter_check(evidence)


@pytest.mark.parametrize(
    ("static", "mark"),
    [
        ({}, "bad"),
        ({"coulomb": Parameter(0.1, identified=False), "static": Parameter(0.1, identified=False)}, "bad"),
        ({"coulomb": Parameter(0.1), "static": Parameter(0.1, identified=False)}, "care"),
        ({"coulomb": Parameter(0.1), "static": Parameter(0.1)}, "good"),
    ],
)
def test_what_the_data_determine(static: dict[str, Parameter], mark: str) -> None:
    check = parameters_check(static)
    assert check.mark == mark
    if mark == "bad":
        assert check.sentence == "The data determine no parameter at all."
    if mark == "care":
        assert check.sentence == "The data do not determine stiction."
