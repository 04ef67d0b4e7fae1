"""Files made to do harm: no crash, no hang, no memory blow-up, nothing run, nothing written elsewhere."""

from __future__ import annotations

import ast
import gzip
import signal
import tracemalloc
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

import idtool
from idtool.errors import InputError, RigFault
from idtool.experiment.recipe import read_recipe, recipe_text
from idtool.importing import import_recording
from idtool.log import Log
from idtool.parameters import Parameters
from idtool.parameters.axis_file import AxisFile
from idtool.rig import open_rig
from idtool.rig.plant_file import read_plant_file

HEAD = (
    b'# ffc-id-log = 1\n# experiment = "sweep"\n# [axis]\n# kind = "rotary"\n'
    b"# torque_constant_nm_per_a = 2.67\ntrial,time_s,velocity_rad_s,current_a\n"
)
TOML_READERS: list[Callable[[Path], Any]] = [
    Parameters.read,
    AxisFile.read,
    lambda path: read_recipe(str(path)),
    read_plant_file,
]


@contextmanager
def bounded(megabytes: float, cpu_s: float = 20.0) -> Iterator[None]:
    """Fails when what is inside takes more memory or computing time."""

    def too_long(*_: object) -> None:
        raise AssertionError(f"took over {cpu_s} s of computing")

    before = signal.signal(signal.SIGVTALRM, too_long)
    signal.setitimer(signal.ITIMER_VIRTUAL, cpu_s)
    tracemalloc.start()
    try:
        yield
        peak = tracemalloc.get_traced_memory()[1] / 2**20
    finally:
        tracemalloc.stop()
        signal.setitimer(signal.ITIMER_VIRTUAL, 0.0)
        signal.signal(signal.SIGVTALRM, before)
    assert peak < megabytes, f"{peak:.0f} MB"


@pytest.mark.parametrize("head", [b"", b'# x = "', HEAD, HEAD + b"0,0,0.1,1\n"])
@pytest.mark.parametrize("packed", [False, True])
def test_a_line_of_a_gigabyte(tmp_path: Path, head: bytes, packed: bool) -> None:
    file = tmp_path / "log.csv"
    if packed:  # a bomb: 64 MB of one character in 64 kB
        file.write_bytes(gzip.compress(head + b"1" * (64 << 20), 1))
    else:
        file.write_bytes(head)
        with open(file, "r+b") as stream:
            stream.truncate(1 << 30)
    with bounded(30), pytest.raises(InputError, match="is over 1 MiB, so it is not a log"):
        Log.read(file)


@pytest.mark.parametrize("read", TOML_READERS)
def test_a_toml_file_of_a_gigabyte(tmp_path: Path, read: Callable[[Path], Any]) -> None:
    file = tmp_path / "big.toml"
    file.write_bytes(b'schema = "x"\n')
    with open(file, "r+b") as stream:
        stream.truncate(1 << 30)
    with bounded(30), pytest.raises(InputError, match="over 8 MiB"):
        read(file)


def test_the_header_of_a_log_that_unfolds(tmp_path: Path) -> None:
    file = tmp_path / "log.csv"
    file.write_bytes(b"# ffc-id-log = 1\n# a" + b".a" * 200_000 + b" = 1\n" + HEAD + b"0,0,0.1,1\n")
    with bounded(100), pytest.raises(InputError, match="a key of over 100 parts"):
        Log.read(file)


NESTED = {
    "lists": "a = " + "[" * 200_000,
    "closed lists": "a = " + "[" * 20_000 + "]" * 20_000,
    "tables": "a = " + "{a = " * 100_000,
    "dotted key": "a" + ".a" * 200_000 + " = 1",
    "dotted header": "[a" + ".a" * 200_000 + "]",
    "many long headers": "\n".join(f"[{'a.' * 400}b{i}]" for i in range(1000)),
    "many tables": "\n".join(f"[[effects]]\nname = '{i}'" for i in range(5_000)),
    "long number": "a = " + "9" * 900_000,
    "long key": "a" * 900_000 + " = 1",
    "long text": "a = '" + "b" * 900_000 + "'",
    "many keys": "\n".join(f"k{i} = 1" for i in range(20_000)),
}


@pytest.mark.parametrize("read", TOML_READERS)
@pytest.mark.parametrize("text", NESTED.values(), ids=NESTED.keys())
def test_toml_that_unfolds(tmp_path: Path, read: Callable[[Path], Any], text: str) -> None:
    """TOML has no references to multiply, so what there is to abuse is depth and number."""
    file = tmp_path / "deep.toml"
    file.write_text(text[: (1 << 20) - 1])
    with bounded(400), pytest.raises(InputError) as caught:
        read(file)
    assert len(str(caught.value)) < 1000


@pytest.mark.parametrize(
    "name", ["../../../../etc/passwd", "..", "sweep/../sweep", "/etc/hostname\0", "a" * 5000]
)
def test_a_path_in_a_name_leads_nowhere(name: str) -> None:
    with pytest.raises(InputError):
        recipe_text(name)
    with pytest.raises((InputError, RigFault)):
        open_rig(f"sim:{name}")
    with pytest.raises((InputError, RigFault)):
        open_rig(f"replay:{name}")
    with pytest.raises((InputError, RigFault)):
        open_rig(f"dynamixel:{name}")


def test_names_from_files_name_no_files(tmp_path: Path) -> None:
    """A recipe whose name and experiment are paths is logged where the user said, and only there."""
    from idtool.experiment.runner import run

    recipe = tmp_path / "recipe.toml"
    recipe.write_text(
        recipe_text("sine")
        .replace('name = "sine"', 'name = "../../evil"')
        .replace('experiment = "sine"', 'experiment = "../../evil"')
    )
    inside = tmp_path / "a" / "b"
    inside.mkdir(parents=True)
    with open_rig("sim:bench") as rig:
        run(read_recipe(str(recipe)), rig, inside / "log.csv")
    assert Log.read(inside / "log.csv").experiment == "../../evil"
    assert sorted(path.name for path in tmp_path.rglob("*")) == ["a", "b", "log.csv", "recipe.toml"]


@settings(
    max_examples=60,
    suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow],
)
@given(st.binary(max_size=400), st.sampled_from([".toml", ".csv", ".mat", ".parquet"]))
def test_arbitrary_bytes_are_refused_or_read(tmp_path: Path, content: bytes, suffix: str) -> None:
    file = tmp_path / f"any{suffix}"
    file.write_bytes(content)
    readers = TOML_READERS if suffix == ".toml" else [Log.read, import_recording]
    for read in readers:
        with suppress(InputError):
            read(file)


def test_nothing_is_evaluated_unpickled_or_handed_to_a_shell() -> None:
    """Over the syntax trees of the whole package."""
    forbidden = {"eval", "exec", "compile", "__import__"}
    modules = {"pickle", "marshal", "shelve", "subprocess", "dill", "cloudpickle", "yaml"}
    root = Path(idtool.__file__).parent
    files = [*root.rglob("*.py"), *(root.parent / "cli").rglob("*.py")]
    assert len(files) > 100
    for file in files:
        for node in ast.walk(ast.parse(file.read_text())):
            if isinstance(node, ast.Call) and isinstance(node.func, ast.Name):
                assert node.func.id not in forbidden, file
            if isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name) and node.value.id == "os":
                assert node.attr not in {"system", "popen"}, file
                assert not node.attr.startswith(("exec", "spawn")), file
            imports = isinstance(node, ast.Import | ast.ImportFrom)
            names = [alias.name for alias in node.names] if imports else []
            if isinstance(node, ast.ImportFrom) and node.module:
                names.append(node.module)
            found = modules & {name.partition(".")[0] for name in names}
            # the live page is served by a process of its own: this program, by its path, without a shell
            assert found <= ({"subprocess"} if file.name == "view.py" else set()), file
