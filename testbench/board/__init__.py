"""The exported C on a simulated board: cycles per step, flash and RAM.

    measure(parameters, folder)        one parameter file

Needs avr-gcc, avr-libc and simavr (Debian: gcc-avr avr-libc simavr).
"""

from testbench.board.measure import CLOCK_HZ, Figures, measure, missing

__all__ = ["CLOCK_HZ", "Figures", "measure", "missing"]
