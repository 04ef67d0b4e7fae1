"""The commands of `ffc-id`: a group whose sub-commands are imported only when they are used.

`ffc-id --help` must answer at once, so nothing here imports numpy, numba or matplotlib.
"""

from __future__ import annotations

import click

from .lazy import LazyGroup

#: command -> (module beside this one, function, help line)
COMMANDS: dict[str, tuple[str, str, str]] = {
    "demo": ("demo", "demo", "The whole loop on the simulated rig, with an undeclared effect."),
    "rigs": ("rigs", "rigs", "List the rigs."),
    "recipes": ("rigs", "recipes", "List the experiment recipes, or show one."),
    "run-gravity": ("run", "run_gravity", "Payload steps: move slowly up and down at each payload."),
    "run-sweep": ("run", "run_sweep", "Velocity sweep: constant speeds both ways."),
    "run-sine": ("run", "run_sine", "Velocity sines of several frequencies."),
    "run": ("run", "run_any", "Run any recipe."),
    "init": ("init", "init", "Write an axis file: kind, torque constant, limits."),
    "import": ("importing", "import_recording", "Turn a recording from elsewhere into a log."),
    "data": ("data", "data", "Recordings to try it on: one that comes along, and public ones."),
    "plot": ("plot", "plot", "Draw a log before any fit."),
    "check": ("check", "check", "Quality of logs before any fit."),
    "fit-gravity": ("fit", "fit_gravity", "Recover the gravity coefficients."),
    "fit-static": ("fit", "fit_static", "Recover the static (Stribeck) friction parameters."),
    "fit-dynamic": ("fit", "fit_dynamic", "Recover sigma0 and sigma1 of the LuGre model."),
    "fit-motion": ("fit_motion", "fit_motion", "Fit the position that the effort makes, not the torque."),
    "diagnose": ("diagnose", "diagnose", "Find the effect that the model lacks; error before and after."),
    "identify": ("diagnose", "identify", "All fits and the diagnosis in one go."),
    "fleet": ("fleet", "fleet", "Identify many sessions in parallel; compare the units."),
    "predict": ("predict", "predict", "Predict the torque of logs with a parameter file."),
    "simulate": ("simulate", "simulate", "Simulate the position of logs with a parameter file."),
    "calibrate": ("calibrate", "calibrate", "The torque constant from a load that is known."),
    "compare": ("compare", "compare", "Compare two parameter files: unit to unit, before and after."),
    "report": ("report", "report", "Make the fit report: one HTML page and its figures."),
    "tune": ("tune", "tune", "Gains of the light mode for a wanted feel."),
    "virtual-servo": ("virtual_servo", "virtual_servo", "A virtual servo, to rehearse a session with."),
    "teach": ("teach", "teach", "Run the force-free controller: a hand moves the axis."),
    "play": ("play", "play", "Play a taught path back."),
    "jog": ("jog", "jog", "Move the axis by the arrow keys."),
    "completion": ("completion", "completion", "Print the completion script of bash, zsh or fish."),
    "export": ("export", "export", "Turn a parameter file into what other programs and boards use."),
}


def _version(ctx: click.Context, _: click.Parameter, value: bool) -> None:
    if value and not ctx.resilient_parsing:
        from idtool.version import __version__

        click.echo(f"ffc-id {__version__}")
        ctx.exit()


@click.command(
    cls=LazyGroup,
    commands_of=COMMANDS,
    context_settings={"help_option_names": ["-h", "--help"]},
    epilog="Exit codes: 0 done, 2 usage, 3 bad input, 4 rig or device fault, 70 a fault of the program, "
    "130 interrupted.",
)
@click.option(
    "--version", is_flag=True, expose_value=False, is_eager=True, callback=_version, help="Show the version."
)
def ffc_id() -> None:
    """Identify gravity, friction and whatever else one servo axis feels; then let a hand move it.

    \b
    ffc-id demo                          see the whole loop on a simulated axis
    ffc-id run-sweep --rig sim:paper -o sweep.csv        run an experiment
    ffc-id identify *.csv -o result                      fits, diagnosis and report of your logs
    ffc-id teach -p result/params.toml --rig sim:paper   hand guiding
    """
