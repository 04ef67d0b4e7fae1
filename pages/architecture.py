"""The picture of docs/architecture.md, from the imports themselves: rooms as boxes, imports as arrows. And
the account of lines.

python -m pages.architecture
"""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path

from pages import markdown

PACKAGE = Path("idtool")
PAGE = Path("docs/architecture.md")

#: Every room and what it is for; one may import itself and those before it, never one behind it.
ROOMS = {
    "version": "the version, for those who write it into files",
    "errors": "`InputError` and `RigFault`: one sentence with file, place and remedy",
    "io": "files read whole or refused, written whole or not at all; downloads; TOML; signals; doors",
    "model": "pure functions on arrays: gravity, Stribeck, LuGre (compiled), their sum; units",
    "effects": "one file an effect, and the registry",
    "presentation": "how numbers, names and figures look",
    "parameters": "the one parameter file, the axis, the correction",
    "control": "the force-free controller alone: no pandas, no rig, no log",
    "log": "the one log: table, writer, format, repair, sensor faults",
    "signals": "from logs to arrays: smoother, Kalman filter, low-pass, `Recording`",
    "importing": "recordings of other programs into logs",
    "rig": "what moves: the simulated axis, a servo on a bus, a log played back; supervisor and limits",
    "live": "the page that shows the axis while it moves, served by a process of its own",
    "virtual_servo": "a servo on a virtual bus, to rehearse a session with",
    "experiment": "recipes, trajectories, the runner",
    "guiding": "hand guiding on a rig: session, simulated hand, record, figure",
    "fit": "staged searches and the joint fit, covariance, identifiability",
    "simulation": "a parameter file as a plant: logs simulated forward, the search for the motion",
    "diagnosis": "the residual, the effect behind it, the extended model",
    "verbs": "what a person asks of logs: identify, predict, check, simulate, fit the motion",
    "compare": "parameters beside parameters, errors beside errors",
    "report": "the result folder and its page",
    "export": "C, MuJoCo, URDF, ROS 2, JSON",
    "api": "what a person at a notebook calls: `identify` and its result",
    "fleet": "many sessions in parallel, and what differs between units",
}


def imported(file: Path) -> Iterator[str]:
    """The modules that a file imports by their whole name, wherever in it."""
    for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and not node.level:
            yield node.module or ""
            yield from (f"{node.module}.{alias.name}" for alias in node.names)


def arrows(package: Path, room: str) -> Iterator[tuple[Path, str]]:
    """(file, room) for every import of a room from a file of this one."""
    place = package / room
    for file in sorted(place.rglob("*.py")) if place.is_dir() else [package / f"{room}.py"]:
        for name in imported(file):
            parts = name.split(".")
            if parts[0] == "idtool" and len(parts) > 1:
                yield file, parts[1]


def picture() -> str:
    """Mermaid text, without arrows that a longer way says already and without those to errors and io."""
    quiet = {"version", "errors", "io"}
    uses = {room: {r for _, r in arrows(PACKAGE, room)} - quiet - {room} for room in ROOMS}
    reach: dict[str, set[str]] = {}
    lines = ["```mermaid", "flowchart BT"]
    for room in ROOMS:
        reach[room] = uses[room].union(*(reach[other] for other in uses[room]))
        if room in quiet:
            continue
        lines.append(f"    {room}")
        direct = (other for other in uses[room] if not any(other in reach[way] for way in uses[room]))
        lines.extend(f"    {room} --> {other}" for other in sorted(direct))
    return "\n".join([*lines, "```\n"])


def table() -> str:
    """The list of the rooms."""
    rows = ((f"`{_place(room)}`", what) for room, what in ROOMS.items())
    return "\n".join([*markdown.table(("room", "what is in it"), rows), ""])


def _place(room: str) -> Path:
    """The folder of a room, or the file that it is."""
    folder = PACKAGE / room
    return folder if folder.is_dir() else folder.with_suffix(".py")


def spoken(tree: ast.Module) -> set[int]:
    """The lines of all docstrings."""
    kinds = (ast.Module, ast.ClassDef, ast.FunctionDef, ast.AsyncFunctionDef)
    first = (node.body[0] for node in ast.walk(tree) if isinstance(node, kinds) and node.body)
    texts = (one for one in first if isinstance(one, ast.Expr) and isinstance(one.value, ast.Constant))
    return {line for one in texts for line in range(one.lineno, (one.end_lineno or one.lineno) + 1)}


def lines_of(folder: Path) -> tuple[int, int, int, int]:
    """Files, lines, lines of code (no blank, comment or docstring), and lines of the longest file."""
    counts = []
    for file in [folder] if folder.is_file() else sorted(folder.rglob("*.py")):
        text = file.read_text(encoding="utf-8")
        said, lines = spoken(ast.parse(text)), text.splitlines()
        code = [line for k, line in enumerate(lines, 1) if k not in said and line.strip()]
        counts.append((len(lines), sum(not line.lstrip().startswith("#") for line in code)))
    return len(counts), sum(n for n, _ in counts), sum(n for _, n in counts), max(n for n, _ in counts)


def account() -> str:
    """Lines of every room and folder."""
    folders = [Path(name) for name in ("cli", "testbench", "studies", "pages", "benchmarks", "tests")]
    counted = [(place, *lines_of(place)) for place in (*map(_place, ROOMS), *folders)]
    rows = ["| | files | lines | of code | longest file |", "|---|---:|---:|---:|---:|"]
    rows += [f"| `{place}` | " + " | ".join(f"{n:,}" for n in counts) + " |" for place, *counts in counted]
    whole = [sum(counts[k] for place, *counts in counted if place != Path("tests")) for k in range(3)]
    return "\n".join([*rows, f"| all but `tests` | {whole[0]:,} | {whole[1]:,} | {whole[2]:,} | |", ""])


def page(text: str) -> str:
    """The page with its picture and its list as the code is now."""
    for part, made in (("picture", picture()), ("rooms", table())):
        text = markdown.with_made(text, part, made, "docs-architecture")
    return text


def main() -> None:
    text = page(PAGE.read_text(encoding="utf-8"))
    PAGE.write_text(markdown.with_made(text, "lines", account(), "docs-architecture"), encoding="utf-8")


if __name__ == "__main__":
    main()
