"""A simulated servo axis of other habits than ours, to judge the toolkit by.

It shares no code and no formula with `idtool`: its own friction laws, drives, commands and sensors, and
only the log format in common. `python -m testbench.other_plants -o DIR` writes sessions with their truth.
"""
