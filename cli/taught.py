"""What a run of `ffc-id teach` came to, for a person and for a program."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from idtool.model.units import torque_name, unit_text

from .tables import print_table

if TYPE_CHECKING:
    from idtool.control import ForceFreeController
    from idtool.guiding import TeachFigures, TeachResult
    from idtool.parameters import Parameters

    from .screen import Screen


@dataclass(frozen=True)
class Taught:
    """A run that is over.

    Attributes:
        parameters: the file that it ran with.
        controller: that ran.
        result: what came out.
        log, figure: where it was written and drawn; None for nowhere.
        bare: the same hand without the file's effects; None where there are none.
        corrected: whether a correction was compensated too.
    """

    parameters: Parameters
    controller: ForceFreeController
    result: TeachResult
    log: Path | None
    figure: Path | None
    bare: TeachFigures | None
    corrected: bool

    def document(self) -> dict[str, Any]:
        """For `--json`."""
        controller, result = self.controller, self.result
        return {
            "schema": "ffc-id/teach/1",
            "gains": {
                "command_gain_s": controller.command_gain,
                "loop_gain": controller.loop_gain,
                "period_s": controller.period,
            },
            "seconds": float(result.record.time[-1] - result.record.time[0]),
            "figures": result.figures.to_document() if result.figures else None,
            "notes": list(result.notes),
            "interrupted": result.interrupted,
            "log": str(self.log) if self.log else None,
            "figure": str(self.figure) if self.figure else None,
            "without_effects": self.bare.to_document() if self.bare else None,
        }

    def show(self, screen: Screen) -> None:
        """On a screen."""
        controller, result, bare = self.controller, self.result, self.bare
        kind = self.parameters.axis.kind
        torque, speed = unit_text("torque", kind), unit_text("velocity", kind)
        if result.figures is not None:
            rows = [
                (
                    f"{index} {'+' if push.direction > 0 else '−'}{'' if push.from_motion else ' held'}",
                    f"{push.torque:.4f}",
                    _maybe(push.force_n),
                    f"{push.speed:.4f}",
                    _maybe(push.speed_mm_s),
                    f"{push.stop_ms:.0f}" if push.from_motion else "",
                    f"{push.overshoot_counts:.1f}",
                    f"{push.ripple_counts:.1f}",
                    f"{1e3 * push.energy_to_hand:.1f}",
                )
                for index, push in enumerate(result.figures.pushes, start=1)
            ]
            headings = (
                "push", f">{torque_name(kind)} ({torque})", ">force (N)", f">speed ({speed})", ">mm/s",
                ">stop (ms)", ">overshoot", ">ripple", ">to hand (mJ)",
            )  # fmt: skip
            print_table(screen, headings, rows, title="Hand guiding")
            screen.print(_summary(result.figures, torque, speed))
            if bare is not None and bare.force_n is not None and result.figures.force_n is not None:
                what = "effects of the file and correction" if self.corrected else "the file's effects"
                screen.print(
                    f"{what} are worth: {bare.force_n:.2f} ± {bare.uneven_n:.2f} N without them,"
                    f" {result.figures.force_n:.2f} ± {result.figures.uneven_n:.2f} N with them (mean of the"
                    " hand and how far it strays from it, rms)."
                )
        else:
            seconds = float(result.record.time[-1] - result.record.time[0])
            moved = float(result.record.position[-1] - result.record.position[0])
            screen.print(
                f"{seconds:.1f} s of hand guiding, from {result.record.position[0]:.4f} by {moved:+.4f}"
                f" {unit_text('position', kind)}; no simulated hand, so no figures of it."
            )
        unit = f"{speed} per {torque}"
        screen.print(
            f"gains: K_r {controller.command_gain:g} s, K_c {controller.loop_gain:g} {unit},"
            f" period {1e3 * controller.period:g} ms"
        )
        for note in result.notes:
            screen.print(f"note: {note}")
        for path in (self.log, self.figure):
            if path is not None:
                screen.print(f"written: {path}", folded=False)


def _summary(figures: TeachFigures, torque: str, speed: str) -> str:
    at_part = (
        f"{figures.force_n:.2f} N moves it at {figures.speed_mm_s:.2f} mm/s"
        if figures.force_n is not None and figures.speed_mm_s is not None
        else f"{figures.torque:.4f} {torque} moves it at {figures.speed:.4f} {speed}"
    )
    return (
        f"{at_part}; it stops within {figures.stop_ms:.0f} ms of letting go, overshoots by"
        f" {figures.overshoot_counts:.1f} encoder counts and then stands still to"
        f" {figures.ripple_counts:.1f} counts."
    )


def _maybe(value: float | None) -> str:
    return "" if value is None else f"{value:.2f}"
