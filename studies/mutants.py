"""Mutation testing of what keeps a hand safe: a number, a sign, a comparison is changed; a test must fail.

Of each module a seeded sample of the mutants of cosmic-ray is tried on a copy of the project, each against
that module's own quick tests. The compiled code runs as plain Python there, which costs less than compiling
every mutant. A mutant that survives is a change that no quick test notices; some change nothing at all.

python -m studies.mutants [--most N] [--module NAME] [--out docs/reliability.md]        (make mutants)
"""

from __future__ import annotations

import os
import random
import re
import shutil
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path

import click
from cosmic_ray.work_db import WorkDB, use_db
from cosmic_ray.work_item import TestOutcome, WorkerOutcome, WorkItem, WorkResult

from pages import markdown

_PROJECT = Path(__file__).resolve().parent.parent
_SEED = 1
#: Numbers changed by one, conditions turned round, signs and the four operations exchanged. Other exchanges
#: of operators (a shift in place of a sum) fail at once and say nothing.
_KINDS = re.compile(
    r"core/(NumberReplacer|AddNot|ReplaceAndWithOr|ReplaceOrWithAnd|ReplaceTrueWithFalse|ReplaceFalseWithTrue"
    r"|ReplaceUnaryOperator_(USub_UAdd|Delete_USub|Delete_Not)|ZeroIterationForLoop"
    r"|ReplaceComparisonOperator_(Lt_Gt|Gt_Lt|LtE_GtE|GtE_LtE|Eq_NotEq|NotEq_Eq|Is_IsNot|IsNot_Is)"
    r"|ReplaceBinaryOperator_(Add_Sub|Sub_Add|Mul_Div|Div_Mul))$"
)
_TIMEOUT_S = 180.0
_COPIED = ("idtool", "cli", "recipes", "data", "tests", "testbench", "studies", "benchmarks", "pages")


@dataclass(frozen=True)
class Module:
    """One module of `idtool/control/`, and the tests of `tests/control/` that must notice its mutants."""

    path: str
    what: str
    tests: tuple[str, ...]
    options: str = ""


_KERNEL, _MOTION = "admittance_kernel", "admittance_motion"
MODULES = (
    Module("guard", "limits and the check of every measurement", ("guard",), " -k 'not any_'"),
    Module("session_limits", "speed, energy, idle time", ("session_limits",)),
    Module("rest_load", "the load at rest", ("rest_load",)),
    Module("button", "braking and holding", ("sensing",)),
    Module("sensing", "the hand's torque, published law", ("sensing",)),
    Module("paper", "the published law", ("sensing",)),
    Module("admittance/hand", "the estimate of the hand", (_KERNEL, _MOTION)),
    Module("admittance/rest", "the admittance law at rest", (_KERNEL,)),
    Module("admittance/motion", "and in motion", (_MOTION,)),
    Module("admittance/tare", "its tare", (_MOTION, "tare")),
    Module("admittance/kernel", "the law, one sample", (_KERNEL, _MOTION)),
    Module("admittance/constants", "its constants", (_KERNEL, _MOTION, "admittance_law")),
    Module("load", "the model's torque", ("online",)),
    Module("online", "the model, sample by sample", ("online",)),
    Module("law", "what both laws share", ("law",)),
    Module("enabling", "the button around the law", ("button", "rest_load")),
    Module("force_free", "the controller around all of them", ("controller", "sensing", "force_free")),
)


@dataclass(frozen=True)
class Score:
    """What became of a module's mutants.

    Attributes:
        possible: mutants there are, of the kinds that are tried.
        tried: of them.
        survived: the change of each that no test noticed, as a diff.
    """

    module: Module
    possible: int
    tried: int
    survived: tuple[str, ...]


def score(module: Module, folder: Path, most: int) -> Score:
    """Try a sample of a module's mutants in a copy of the project.

    Raises:
        RuntimeError: the tests fail without a mutant.
    """
    name = module.path.replace("/", "_")
    config, session = folder / f"{name}.toml", folder / f"{name}.sqlite"
    command = f"{sys.executable} -m pytest -x -p no:cacheprovider -p no:xdist -p no:rerunfailures"
    tests = " ".join(f"tests/control/test_{one}.py" for one in module.tests)
    config.write_text(
        f'[cosmic-ray]\nmodule-path = "idtool/control/{module.path}.py"\ntimeout = {_TIMEOUT_S}\n'
        f'test-command = "{command} {tests}{module.options}"\nexcluded-modules = []\n'
        '[cosmic-ray.distributor]\nname = "local"\n',
        encoding="utf-8",
    )
    _cosmic_ray(folder, "init", config, session)
    _cosmic_ray(folder, "baseline", config)
    with use_db(session) as db:
        possible, chosen = _sample(db, most)
    _cosmic_ray(folder, "exec", config, session)
    with use_db(session, mode=WorkDB.Mode.open) as db:
        outcomes = [result for job, result in db.results if job in chosen]
    survived = [one.diff or "" for one in outcomes if one.test_outcome is TestOutcome.SURVIVED]
    return Score(module, possible, len(outcomes), tuple(sorted(survived)))


def _sample(db: WorkDB, most: int) -> tuple[int, set[str]]:
    """How many mutants there are, and the jobs that are to be tried; the others are marked as skipped."""
    items = sorted(db.pending_work_items, key=lambda item: _place(item))
    mine = [item for item in items if all(_KINDS.match(one.operator_name) for one in item.mutations)]
    chosen = {item.job_id for item in random.Random(_SEED).sample(mine, min(most, len(mine)))}
    skipped = WorkResult(output="not in the sample", worker_outcome=WorkerOutcome.SKIPPED)
    db.set_multiple_results([item.job_id for item in items if item.job_id not in chosen], skipped)
    return len(mine), chosen


def _place(item: WorkItem) -> tuple[object, ...]:
    """An order that does not depend on the names of the jobs."""
    (one,) = item.mutations
    return (*one.start_pos, one.operator_name, one.occurrence)


def _cosmic_ray(folder: Path, command: str, *files: Path) -> None:
    environment = {**os.environ, "NUMBA_DISABLE_JIT": "1", "OPENBLAS_NUM_THREADS": "1"}
    done = subprocess.run(
        [sys.executable, "-m", "cosmic_ray.cli", command, *map(str, files)],
        cwd=folder,
        env=environment,
        capture_output=True,
        text=True,
        check=False,
    )
    if done.returncode:
        raise RuntimeError(f"cosmic-ray {command} failed: {done.stdout[-2000:]}{done.stderr[-2000:]}")


_HEAD = ("`idtool/control/`", "what it is", "mutants", "tried", "noticed", "")
#: A module's row of the table.
_ROW = re.compile(r"^\| `(?P<path>[\w/]+)\.py` \| .* \| (\d+) \| (\d+) \| (\d+) \| \d+ % \|$", re.MULTILINE)


def table(scores: list[Score], page: str = "") -> list[str]:
    """The scores as Markdown; modules that were not tried keep their row of `page`."""
    counts = {found["path"]: tuple(map(int, found.groups()[1:])) for found in _ROW.finditer(page)}
    for one in scores:
        counts[one.module.path] = one.possible, one.tried, one.tried - len(one.survived)
    known = [(f"`{one.path}.py`", one.what, counts[one.path]) for one in MODULES if one.path in counts]
    together = tuple(map(sum, zip(*(count for _, _, count in known), strict=True)))
    rows = ((*words, *n, f"{100 * n[2] / n[1]:.0f} %") for *words, n in [*known, ("together", "", together)])
    return markdown.table(_HEAD, rows)


@click.command()
@click.option("--most", default=24, show_default=True, help="Mutants of a module to try.")
@click.option("--module", "names", multiple=True, help="Modules to try, all if none is named.")
@click.option(
    "--out",
    type=click.Path(path_type=Path),
    help="Page to write the scores into; modules that are not tried keep theirs.",
)
def main(most: int, names: tuple[str, ...], out: Path | None) -> None:
    """Run the study, show the changes that survived, and write the scores."""
    scores = []
    with tempfile.TemporaryDirectory(prefix="mutants-") as name:
        folder = Path(name)
        for part in _COPIED:
            ignored = shutil.ignore_patterns("__pycache__")
            shutil.copytree(_PROJECT / part, folder / part, ignore=ignored)
        shutil.copy(_PROJECT / "pyproject.toml", folder)
        for module in MODULES:
            if names and module.path not in names:
                continue
            scores.append(score(module, folder, most))
            for change in scores[-1].survived:
                click.echo(change)
            click.echo("\n".join(table(scores[-1:])))
    click.echo("\n".join(table(scores)))
    if out is not None:
        made = table(scores, out.read_text(encoding="utf-8"))
        markdown.write_made("docs/reliability.md", {"mutants": made}, "mutants", out)


if __name__ == "__main__":
    main()
