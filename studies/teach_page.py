"""docs/teach.md from the runs of the study, and its figures."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from idtool.guiding.hand import STANDARD_GRAVITY
from studies.guided_plants import Case, plant_of
from studies.teach import COUNT, GAINS, PERIOD, SPEED, Guided

if TYPE_CHECKING:
    from matplotlib.axes import Axes

#: What is asked for: title, unit, how it is read from a run, its limit.
GOALS: tuple[tuple[str, str, Callable[[Guided], float], float], ...] = (
    ("hand force at 19.2 mm/s, mean of the four pushes", "N", lambda r: r.force, 2.0),
    ("the heaviest of the four", "N", lambda r: r.most, 2.0),
    ("break-away force", "N", lambda r: r.break_away, 1.0),
    ("stop after release", "ms", lambda r: r.stop, 48.0),
    ("drift without a hand, 2 s", "counts", lambda r: r.drift, 1.0),
    ("ripple at rest", "counts", lambda r: r.ripple, 1.0),
    ("starts without a hand", "times", lambda r: float(r.starts), 0.0),
    ("speed ripple while pushed, rms", "mm/s", lambda r: r.swing, 2.0),
    ("energy given to the hand over a push", "mJ", lambda r: r.energy, 0.0),
)


def goals_table(runs: Sequence[Guided]) -> list[str]:
    """Median, 95 % and worst of every goal."""
    lines = [
        "| | median | 95 % | worst | asked for | met by |",
        "|---|---:|---:|---:|---:|---:|",
    ]
    for title, unit, read, limit in GOALS:
        values = np.array([read(run) for run in runs])
        met = int(np.sum(values <= limit))
        lines.append(
            f"| {title}, {unit} | {np.median(values):.3g} | {np.quantile(values, 0.95):.3g} "
            f"| {np.max(values):.3g} | {limit:g} | {met} of {len(values)} |"
        )
    return lines


def stop_table(runs: Sequence[Guided]) -> list[str]:
    """Stop time over how late the readings come."""
    lines = [
        "| readings late by | axes | median, ms | worst, ms | within 48 ms |",
        "|---|---:|---:|---:|---:|",
    ]
    for late, title in ((False, "position and velocity"), (True, "all three")):
        for low, high in ((0.0, 0.005), (0.005, 0.01), (0.01, 0.015), (0.015, 0.0201)):
            stops = np.array(
                [
                    r.stop
                    for r in runs
                    if (r.case.current_delay > 0.0) == late and low <= r.case.motion_delay < high
                ]
            )
            if len(stops):
                lines.append(
                    f"| {title}, {1e3 * low:.0f} to {1e3 * high:.0f} ms | {len(stops)} "
                    f"| {np.median(stops):.0f} | {np.max(stops):.0f} | {np.mean(stops <= 48.0):.0%} |"
                )
    return lines


def stop_bound(case: Case) -> float:
    """No law that reads this axis' current stops it sooner, ms: the first reading of the current after the
    release, then the drive's greatest deceleration until one count before rest."""
    limit = case.truth.drive.position_profile_rad_s2
    speed = SPEED / case.ratio
    seen = PERIOD * (math.floor(round(case.current_delay / PERIOD, 6)) + 1)
    return 1e3 * (seen + max(speed / limit - math.sqrt(2.0 * COUNT / limit), 0.0))


def stop_text(runs: Sequence[Guided]) -> str:
    """What bounds the stop, and what became of it."""
    found = [stop_bound(run.case) for run in runs]
    return _STOP.format(
        limit=runs[0].case.truth.drive.position_profile_rad_s2,
        low=min(found),
        high=max(found),
        possible=sum(bound <= 48.0 for bound in found),
        axes=len(runs),
        met=sum(run.stop <= 48.0 for run in runs),
    )


def worst_table(runs: Sequence[Guided]) -> list[str]:
    """The axis at which each goal came out worst."""
    lines = [
        "| worst | value | axis | friction level, viscous | payload off | hand | late | effects |",
        "|---|---:|---|---|---:|---:|---|---|",
    ]
    for title, unit, read, _ in GOALS:
        run = max(runs, key=read)
        case = run.case
        lines.append(
            f"| {title.split(',')[0]} | {read(run):.3g} {unit} | {case.name} "
            f"| {case.friction[0]:.2f}, {case.friction[1]:.2f} | {case.payload - 0.4:+.2f} kg "
            f"| {case.stiffness:.0f} N/m | {1e3 * case.motion_delay:.0f} / {1e3 * case.current_delay:.0f} ms "
            f"| {', '.join(case.effects) or '-'} |"
        )
    return lines


def bounds() -> list[str]:
    """What no law can do that knows nothing but the current, in newtons at the slide."""
    lines = []
    for axis in ("paper", "bench"):
        plant = plant_of(axis)
        ratio = plant.gravity["per_payload_nm_per_kg"] / STANDARD_GRAVITY
        speed = SPEED / ratio
        friction = plant.friction["coulomb_nm"] + plant.friction["viscous_nm_s_per_rad"] * speed
        load, drag = 0.1 * STANDARD_GRAVITY, 0.3 * friction / ratio
        lines.append(
            f"- `sim:{axis}`: 0.1 kg is {load:.2f} N ({load * ratio:.4f} N m); 30 % of the friction at "
            f"19.2 mm/s is {drag:.2f} N; together {load + drag:.2f} N either way, a span of "
            f"{2 * (load + drag):.2f} N. "
            f"Friction at rest holds {plant.friction['static_nm'] / ratio:.2f} N."
        )
    return lines


def draw_spread(groups: dict[str, dict[bool, list[Guided]]], path: Path) -> None:
    """Hand force against what the file has wrong, with and without a tare."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(9.0, 3.8), layout="constrained")
    FigureCanvasAgg(figure)
    left, right = figure.subplots(1, 2)
    runs = {tared: [r for group in groups.values() for r in group[tared]] for tared in (False, True)}
    colours = {False: "#b9bec6", True: "#1f5fa8"}
    names = {False: "as switched on", True: "after tare()"}
    for tared, some in runs.items():
        wrong = [0.5 * sum(r.case.friction) for r in some]
        left.plot(wrong, [r.force for r in some], ".", ms=3, color=colours[tared], label=names[tared])
        stops = np.sort([r.stop for r in some])
        right.plot(stops, np.arange(1, len(stops) + 1) / len(stops), color=colours[tared], label=names[tared])
    left.axhline(2.0, color="#c8502d", lw=0.8)
    left.axhline(5.56, color="0.4", lw=0.8, ls="--")
    left.text(0.71, 5.62, "published: 5.56 N", fontsize=8, color="0.3")
    left.set(xlabel="true friction over the file's", ylabel="hand force at 19.2 mm/s (N)", ylim=(0.0, 6.2))
    right.axvline(48.0, color="#c8502d", lw=0.8)
    right.set(
        xlabel="stop after release (ms)", ylabel="share of the axes", xlim=(0.0, 200.0), ylim=(0.0, 1.0)
    )
    for axes in (left, right):
        axes.grid(alpha=0.25)
        axes.legend(frameon=False, fontsize=8, loc="lower right" if axes is right else "center left")
    figure.savefig(path, dpi=130)


def draw_run(run: Guided, path: Path, *, until: float) -> None:
    """Speed and force of a run over time."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(9.0, 5.0), layout="constrained")
    FigureCanvasAgg(figure)
    upper, lower = figure.subplots(2, 1, sharex=True)
    ratio, felt = run.case.ratio, run.felt[run.felt[:, 0] < until]
    time = 1e-3 * np.arange(1, run.truth.shape[1] + 1)
    rows = time < until
    upper.plot(time[rows], 1e3 * ratio * run.truth[1, rows], color="#2d7d46", lw=1.2, label="slide")
    _level(upper, 19.2)
    upper.set_ylabel("speed (mm/s)")
    lower.plot(felt[:, 0], felt[:, 2] / ratio, color="#1f5fa8", lw=0.8, label="hand, estimated")
    lower.plot(time[rows], run.truth[3, rows] / ratio, color="#c8502d", lw=1.3, label="hand")
    lower.fill_between(
        felt[:, 0],
        -felt[:, 3] / ratio,
        felt[:, 3] / ratio,
        color="0.85",
        lw=0,
        label="doubt: what the model may be wrong by",
    )
    _level(lower, 2.0)
    lower.set(xlabel="time (s)", ylabel="force (N)")
    for axes in (upper, lower):
        axes.grid(alpha=0.25)
        axes.margins(x=0.0)
        axes.legend(frameon=False, fontsize=8, loc="upper right", ncols=3)
    figure.savefig(path, dpi=130)


def _level(axes: Axes, value: float) -> None:
    for sign in (-1.0, 1.0):
        axes.axhline(sign * value, color="0.5", lw=0.7, ls="--")


def page(
    groups: dict[str, dict[bool, list[Guided]]],
    corners: list[Guided],
    reproduction: list[str],
    effects: list[str],
    touched: list[str],
) -> str:
    """docs/teach.md."""
    tared = [r for group in groups.values() for r in group[True]]
    fresh = [r for group in groups.values() for r in group[False]]
    lines = [_TITLE, *reproduction]
    lines += [_HEAD.format(axes=len(tared), gain=GAINS.loop_gain), *bounds(), _TARE]
    lines += [f"## After `tare()`: all {len(tared)} axes", "", *goals_table(tared), ""]
    lines += ["![Hand force and stop time](images/teach_spread.png)", ""]
    for title, group in groups.items():
        lines += [f"### {title}: {len(group[True])} axes", "", *goals_table(group[True]), ""]
    lines += ["### Where each came out worst", "", *worst_table(tared), ""]
    lines += ["![The axis that needed most force](images/teach_worst.png)", ""]
    lines += [
        "The axis that needed most force: the tare and the first pushes, let go while moving.",
        "",
    ]
    lines += ["### The stop, and how late the readings are", "", *stop_table(tared), "", stop_text(tared)]
    lines += [
        f"### All corners at once: {len(corners)} axes",
        "",
        "Friction level, viscous friction and payload each at an end of their range, a hand of 200 or",
        "2000 N/m, position and velocity late by 0, 10 or 20 ms, on both axes.",
        "",
        *goals_table(corners),
        "",
    ]
    lines += [
        f"## As switched on, without a tare: the same {len(fresh)} axes",
        "",
        _FRESH,
        *goals_table(fresh),
        "",
    ]
    lines += ["## A hand in the tare", "", _TOUCHED, *touched, ""]
    lines += effects
    return "\n".join(lines).rstrip() + "\n"


_TITLE = """# Hand guiding

Made by `make study-teach`. The laws and their reasons are in `idtool/control/force_free.py` and
`idtool/control/light.py`.
"""
_HEAD = """## Lighter

The published law needs 5.56 N for 19.2 mm/s and vibrates when it is tuned lighter. The light mode
(`mode = "light"` in `[controller]`, written by `ffc-id tune`) is an admittance that is driven by what is
*certain* of the hand: the compensation of friction and load is kept at its lower confidence bound, so the
axis takes energy from the hand and never gives any, and it becomes lighter as it learns. Gains for a wanted
feel, with their stability margins: `ffc-id tune -p params.toml --hand-force 2 --speed 19.2 --write`
(N, mm/s). Then `ffc-id teach -p params.toml --rig SPEC --tare`, or from Python

    controller = ForceFreeController(Parameters.read("params.toml"), period_s=0.01)
    controller.tare()           # once `controller.ready`; hands off for three seconds of steps

For three seconds after a stop the way back needs 0.7 N more than break-away, and both ways do for the first
second after a stop of a hand that eased off: a hand that leant on the axis while it stopped leaves such a
torque when it goes, and nothing must start then. In that first second the way back needs another 0.5 N
(`sim:paper`) or 0.8 N (`sim:bench`), as much as a stop may leave in the bristle beyond the doubt. A motion
does not turn round without a rest. (Break-away below is measured after that time.) A fall of the load by the
payload's weight within two periods is a fault: the axis holds, says so, and goes on after `recover()` only.

{axes} axes are drawn around `sim:paper` and `sim:bench`. Their files are wrong by up to 30 % in friction
level, in viscous friction and in the bristle (each apart), by up to 20 % in inertia and by up to 0.1 kg in
the payload; position and velocity, and on half of the axes the current too, are read up to 20 ms late; the
position loop has a gain of 15 to 25 1/s; the hand is a spring and damper of 200 to 2000 N/m. Readings are
those of a DYNAMIXEL (4096 counts, 0.229 rpm, 2.69 mA, noise of a step of current), the controller acts every
10 ms and takes the mean of two readings of the current. K_c is {gain:g} rad/s per N m everywhere.

### What cannot be done, and what can

From one current at one motion no law can tell a hand from a load or a friction that it was not told of. If
it knows nothing else, the force that a hand needs differs between two axes by what their models may be
wrong by, both ways, and the axis must not push the lighter one along:
"""
_TARE = """
So 2 N everywhere with energy that never flows to the hand is impossible without learning: the span alone is
more. What is learned must be learned while nobody touches. At rest that is one number, load and friction
together, and friction holds as much as the load. `tare()` therefore moves the axis to and fro, 9 mm twice in
three seconds, hands off, and learns load, friction level and viscous friction by a Kalman filter. Every
stop of a hand that let go adds to it.
"""
_STOP = """
A hand that lets go shows at best in the first reading of the current taken after it, and from there the
drive cannot be faster than its limit of {limit:.0f} rad/s^2. No law that reads only this current stops an
axis sooner than that: {low:.0f} to {high:.0f} ms, below 48 ms on {possible} of {axes} axes, so the limit
alone excludes no other. {met} stop within 48 ms. The brake asks for the opposite speed for one period, then
for the place where the axis comes to rest; two periods longer where the friction that goes with speed is
more than the hand held, as the drive's integrator still pushes against it and would creep on. Where that
takes in a little too much or too little, the axis still moves by one count at 50 ms. Longer stops come from a
hand that was not seen to let go (it held less than the noise of the current hides, or let go within the
second in which a motion that began anew at once is not believed): the axis then stops as the estimate of the
force fades. On 600 other axes (`python -m studies.teach --seed 11`) 596 stop within 48 ms, two do in 50 ms,
one in 132 and one in 269 ms, which 0.8 N had moved.

At rest a hand that leant on the axis while it stopped is looked for: where the torque changes at once, it
left, and what is left is the zero. Where nothing changes for a second, what is felt then is taken for the
zero with all of it in doubt, so that nothing starts by itself when it goes. Until then both ways need 0.7 N
more. An axis whose push ends within a second of its start has only bent its bristle; it knows that one
better, and may start again after 0.1 s. The break-away forces above 1 N are such stalls in a row, and stops
that left a torque which friction or a leaning hand may have left.

After a stop the bristle holds more than the doubt says on some axes, most where friction is 30 % off and
the stop was short or turned round: 1.2 to 1.4 N on `sim:bench`. That looks like a hand, so nothing is to
start on it: the zero is taken with all of it in doubt, and a hand that turned round at once and pushes back
that lightly must push so much more. Where it is more than even that, or where a periodic torque that the
file lacks comes on top, the axis starts by itself; the tables count it. What the tare leaves beyond noise is
doubt too, as long as the axis is slow.

An axis that was let go at less than its doubt cannot see that. It runs on for 0.1 to 0.4 s and mostly less
than 20 counts while the virtual mass stops; and where the file lacks a ripple or a spring that is more than
the doubt at that place, which no tare of 9 mm has met, for as long as that pushes. A ripple at rest of more
than a count is such an axis.
"""
_TOUCHED = """An axis repeats itself and a hand does not: the mean current of every eighth of the tare's
second cycle is compared with that of the first (`idtool/control/tare.py`). A hand pushes for 0.3 to 1.5 s
somewhere in the tare of every fourth axis from above; what a touch that was not found taught is the force by
which the axis is then wrong, at rest or at 19.2 mm/s. A tare whose two cycles are alike and of which more is
left than noise can be is not used either: the file lacks an effect that the axis has.
"""
_FRESH = """The controller then knows no more than the file and 0.2 s at rest, and leaves to the hand what it
cannot know. The force falls with every stop that it learns from.

A stop is one number from a bristle that is itself uncertain, and a few of them can teach a load and a
friction that are wrong by more than the doubt. Such an axis runs on by itself at 5 to 15 mm/s once a light
push has let go of it: one of these 600, and five of those of `--seed 11`, are the drifts of more than a
count. None of 1,200 does after a tare. So tare the axis; without one, guide it only where it may run on.
"""
