"""What becomes of the axis and of the data when something goes wrong, through the real protocol.

The vendor's SDK, unchanged, talks to the virtual servo; faults come from `idtool.virtual_servo.faults`.

python -m studies.reliability [--repeats N] [--kills N] [--out docs/reliability.md]   (make study-reliability)
"""

from __future__ import annotations

import math
import random
import tempfile
from dataclasses import dataclass
from pathlib import Path

import click
import numpy as np

from idtool import identify
from idtool.errors import RigFault
from idtool.experiment.black_box import fault_path
from idtool.experiment.recipe import parse_recipe
from idtool.experiment.runner import run
from idtool.log import Log
from idtool.parameters import Parameter
from idtool.rig.dynamixel.servo import WATCHDOG_S
from idtool.rig.opening import read_plant
from pages import markdown
from testbench.bench import BAUD, Bench
from testbench.guided_axes.cases import file_of
from testbench.kill import RECIPE, Killed, killed

_PAGE = "docs/reliability.md"
#: Faults that end a run; the seconds are drawn for every repeat, within the motion.
ENDING = {
    "silent@{0}": "the servo no longer answers",
    "burst@{0}=0.6": "nothing arrives for 0.6 s",
    "unplugged@{0}": "the adapter is unplugged",
    "power@{0}": "the servo loses its power for a moment",
    "overload@{0}": "overload shutdown",
    "error@{0}=4": "overheating shutdown",
    "error@{0}=1": "error bit without shutdown (supply voltage)",
    "stuck@{0}": "the encoder stands still",
    "watchdog@{0}": "the watchdog trips",
}
#: Faults that a run should survive.
BUS = ("lost=0.01", "late=0.01", "corrupt=0.01", "twice=0.01", "burst@4=0.05")
#: The axis begins to move this long after the torque is on, and moves this long, s.
_BEGINS_S, _MOVES_S = 3.0, 5.0


@dataclass(frozen=True)
class Ended:
    """One run that a fault ended.

    Attributes:
        kind: of the fault that the user is told.
        stood_after_s: from the fault to standstill, on the axis itself.
        stands: it stood still ever after.
        rows: rows in the log, which was read back.
        history_s: length of the fault's file.
        restored: the servo's settings were put back.
    """

    kind: str
    stood_after_s: float
    stands: bool
    rows: int
    history_s: float
    restored: bool


def ended_by(word: str, seed: int) -> Ended | None:
    """Run into a fault, and look at axis, log and servo afterwards.

    Returns:
        None where the run ended before: servo and host share this computer, and where it is so busy that
        the virtual servo itself does not answer, there is nothing to be learnt.
    """
    at = _BEGINS_S + random.Random(seed).uniform(0.0, _MOVES_S)
    recipe = parse_recipe(RECIPE.format(travel=1.0, repeats=3), "reliability")
    with Bench(word.format(f"{at:.3f}"), seed=seed) as bench, tempfile.TemporaryDirectory() as folder:
        before = bench.table()
        log = Path(folder) / "log.csv"
        try:
            with bench.rig() as rig:
                run(recipe, rig, log)
        except RigFault as fault:
            kind = type(fault).__name__
        else:
            kind = "none"
        struck = bench.mishaps.struck_at
        if struck is None:
            return None
        place, _ = bench.later(1.0)
        stood_after = bench.clock.now() - bench.servo.axis.still_s - struck
        later, _ = bench.later(5.0)
        last = Log.read(fault_path(log)).frame["time_s"]
        return Ended(
            kind,
            max(stood_after, 0.0),
            abs(later - place) < 2e-3,
            len(Log.read(log).frame),
            float(last.iloc[-1] - last.iloc[0]),
            bench.table() | {"hardware_error_status": 0} == before,
        )


@dataclass(frozen=True)
class Survived:
    """One run on a bad bus.

    Attributes:
        finished: it came to its end.
        struck, retries: packets that were lost, late, damaged or doubled; transactions that were repeated.
        samples, overruns, longest_s: as the supervisor counted.
        wrong: rows whose position is not where the axis can have been.
    """

    finished: bool
    struck: int
    retries: int
    samples: int
    overruns: int
    longest_s: float
    wrong: int


def survived(word: str, seed: int) -> Survived:
    """Run on a bad bus, and compare the rows with what the axis can do."""
    recipe = parse_recipe(RECIPE.format(travel=1.0, repeats=3), "reliability")
    with Bench(word, seed=seed) as bench, tempfile.TemporaryDirectory() as folder:
        log = Path(folder) / "log.csv"
        with bench.rig() as rig:
            try:
                done = run(recipe, rig, log)
            except RigFault:
                return Survived(False, sum(bench.mishaps.counts.values()), rig.retries, 0, 0, math.nan, 0)
            retries = rig.retries
        frame = Log.read(log).frame
        way, passed = frame["position_rad"].diff().abs(), frame["time_s"].diff()
        wrong = int((way > 0.6 * passed + 0.0125).sum() + (frame["velocity_rad_s"].abs() > 0.7).sum())
        loop = done.loop
        return Survived(
            True,
            sum(bench.mishaps.counts.values()),
            retries,
            loop.samples,
            loop.overruns,
            loop.longest_s,
            wrong,
        )


SESSION = {
    "gravity": ("0.0", 'kind = "back_and_forth"\npayload_kg = [0.0, 0.3, 0.6, 0.9, 1.2, 1.5]\n'
                       "speed_rad_s = 0.2\ntravel_rad = 0.8\n"),
    "sweep": ("1.5707963267948966", 'kind = "back_and_forth"\n'
              "speed_rad_s = [0.024, 0.048, 0.072, 0.096, 0.144, 0.192, 0.288, 0.384, 0.767]\n"
              "travel_rad = [0.2, 0.25, 0.3, 0.4, 0.5, 0.6, 0.8, 1.0, 2.0]\n"),
    "sine": ("1.5707963267948966", 'kind = "sine"\nfrequency_hz = [0.2, 0.5, 1.0]\n'
             "amplitude_rad_s = 0.6\nduration_s = [10.0, 6.0, 6.0]\n"),
}  # fmt: skip


def identified(baud: int) -> dict[str, tuple[float, Parameter]]:
    """A whole session through the servo: the truth, and what came back."""
    logs = []
    for name, (tilt, trials) in SESSION.items():
        head = f'schema = "ffc-id/recipe/1"\nname = "{name}"\nexperiment = "{name}"\n'
        recipe = parse_recipe(f"{head}[setup]\ntilt_alpha_rad = {tilt}\n[[trials]]\n{trials}", name)
        with Bench() as bench, tempfile.TemporaryDirectory() as folder:
            bench.servo.table["baud_rate"] = {57600: 1, BAUD: 3}[baud]
            log = Path(folder) / "log.csv"
            with bench.rig(baud=baud) as rig:
                run(recipe, rig, log, confirm=bench.setup)
            logs.append(Log.read(log))
    found = identify(logs, seed=0).parameters
    true = file_of(read_plant("bench"))
    truth = {**true.gravity, **true.static, **true.dynamic}
    return {
        name: (truth[name].value, one)
        for name, one in {**found.gravity, **found.static, **found.dynamic}.items()
    }


# ------------------------------------------------------------------------------ the page


def parts(repeats: int, kills: int) -> dict[str, list[str]]:
    """What is made of docs/reliability.md."""
    tried = {word: [ended_by(word, seed) for seed in range(repeats)] for word in ENDING}
    return {
        "watchdog": [
            f"The bus watchdog is armed with {1e3 * WATCHDOG_S:.0f} ms whenever the axis may move. A lost",
            "packet is asked for again up to three times, which takes less than that.",
        ],
        "ends": _ending_table({word: [r for r in runs if r is not None] for word, runs in tried.items()}),
        "bus": _bus_table({word: [survived(word, seed) for seed in range(repeats)] for word in BUS}),
        "kills": _kill_text([killed(seed) for seed in range(kills)]),
        "session": _session_table({baud: identified(baud) for baud in (BAUD, 57600)}),
    }


def _ending_table(ends: dict[str, list[Ended]]) -> list[str]:
    rows = [
        (
            ENDING[word],
            ", ".join(f"`{kind}`" for kind in sorted({r.kind for r in runs})),
            len(runs),
            f"{1e3 * max(r.stood_after_s for r in runs):.0f} ms",
            _share([r.stands for r in runs]),
            _share([r.restored for r in runs]),
            _share([r.rows > 0 for r in runs]),
            f"{np.median([r.history_s for r in runs]):.2f} s",
        )
        for word, runs in ends.items()
    ]
    head = ("what happens", "told as", "runs", "stood still after, longest", "stayed", "settings put back")
    return markdown.table((*head, "logs read back", "last second"), rows)


def _bus_table(bus: dict[str, list[Survived]]) -> list[str]:
    rows = [
        (
            f"`{word}`",
            _share([r.finished for r in runs]),
            sum(r.struck for r in runs),
            sum(r.retries for r in runs),
            f"{100 * sum(r.overruns for r in runs) / max(sum(r.samples for r in runs), 1):.1f} %",
            f"{1e3 * max(r.longest_s for r in runs):.0f} ms",
            sum(r.wrong for r in runs),
        )
        for word, runs in bus.items()
    ]
    head = ("on the bus", "finished", "packets hit", "asked again", "late samples", "longest period")
    return markdown.table((*head, "wrong rows"), rows)


def _kill_text(dead: list[Killed]) -> list[str]:
    stood, behind = [1e3 * d.stood_after_s for d in dead], [1e3 * d.behind_s for d in dead]
    return [
        f"{len(dead)} processes of `ffc-id run` were killed at random instants of their motion, in real",
        f"time. The servo's own watchdog stopped the axis in {_share([d.tripped for d in dead])} cases; it",
        f"stood still {np.median(stood):.0f} ms (median) and at most {max(stood):.0f} ms after the last word",
        f"that the servo heard. Every log was read back; {_share([d.whole for d in dead])} end with a whole",
        f"row, the shortest holds {min(d.rows for d in dead)} rows. Of what was measured at most the last",
        f"block is missing: since the last row the axis had moved on by {np.median(behind):.0f} ms of",
        f"travel (median; at most {max(behind):.0f} ms).",
    ]


def _session_table(session: dict[int, dict[str, tuple[float, Parameter]]]) -> list[str]:
    rows = []
    for name, (truth, _) in next(iter(session.values())).items():
        back = (found[name][1] for found in session.values())
        cells = (
            f"{one.value:.4g} ± {one.stderr or math.nan:.1g} ({100 * (one.value / truth - 1):+.1f} %)"
            for one in back
        )
        rows.append((name.replace("_", " "), f"{truth:g}", *cells))
    return markdown.table(("parameter", "truth", *(f"{baud} baud" for baud in session)), rows)


def _share(good: list[bool]) -> str:
    return f"{sum(good)} of {len(good)}"


@click.command()
@click.option("--repeats", default=4, show_default=True, help="Runs per fault.")
@click.option("--kills", default=50, show_default=True, help="Processes to kill.")
@markdown.out_option(_PAGE)
def main(repeats: int, kills: int, out: Path) -> None:
    """Run the study and write its parts of the page."""
    made = parts(repeats, kills)
    markdown.write_made(_PAGE, made, "study-reliability", out)
    click.echo("\n".join(line for lines in made.values() for line in lines))


if __name__ == "__main__":
    main()
