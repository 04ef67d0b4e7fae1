"""A session that several files look at."""

from __future__ import annotations

import pytest

from idtool.log import Log

from .support import GRAVITY, SINE, SWEEP, record


@pytest.fixture(scope="session")
def session(tmp_path_factory: pytest.TempPathFactory) -> list[Log]:
    """Gravity, sweep and sine on one simulated axis; nobody changes them in place."""
    folder = tmp_path_factory.mktemp("session")
    recipes = {"gravity": GRAVITY, "sweep": SWEEP, "sine": SINE}
    return [
        record(text, folder / f"{name}.csv", seed=seed) for seed, (name, text) in enumerate(recipes.items())
    ]
