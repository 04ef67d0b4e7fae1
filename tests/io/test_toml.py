"""TOML files as people hand them over."""

from __future__ import annotations

from pathlib import Path

import pytest

from idtool.errors import InputError
from idtool.io.toml import load_toml


@pytest.mark.parametrize("beyond", [0, 1])
def test_a_file_that_nobody_would_look_into_is_refused(beyond: int, tmp_path: Path) -> None:
    file = tmp_path / "large.toml"
    head = b"a = 1\n#"
    file.write_bytes(head + b" " * (8 * 2**20 - len(head) + beyond))
    if not beyond:
        assert load_toml(file) == {"a": 1}
        return
    with pytest.raises(InputError, match=r"large.toml: holds over 8 MiB, too much for a parameter file"):
        load_toml(file)
