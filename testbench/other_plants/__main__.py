"""Write sessions of the other axes with their truth: python -m testbench.other_plants -o DIR."""

from __future__ import annotations

from pathlib import Path

import click

from testbench.other_plants.cases import cases
from testbench.other_plants.session import make, save


@click.command()
@click.option("-o", "--out", required=True, type=click.Path(path_type=Path, file_okay=False))
@click.option("--clean", default=10, show_default=True, help="Sessions without an effect.")
@click.option("--single", default=2, show_default=True, help="Sessions with each one of the effects.")
@click.option("--several", default=12, show_default=True, help="Sessions with two or three.")
@click.option("--unknown", default=1, show_default=True, help="Sessions with each disturbance.")
@click.option("--composed", default=2, show_default=True, help="Sessions like a real geared joint.")
@click.option("--seed", default=1, show_default=True)
def main(out: Path, clean: int, single: int, several: int, unknown: int, composed: int, seed: int) -> None:
    """Write sessions of the other axes; those that are there stay."""
    for case in cases(clean, single, several, unknown, composed, seed):
        if (out / case.name / "truth.json").exists():
            continue
        session = make(case.name, case.what, case.seed, composed=case.composed)
        save(session, out)
        click.echo(
            f"{case.name}: {', '.join(session.truth['effects']) or session.truth['disturbance'] or 'none'}"
        )


if __name__ == "__main__":
    main()
