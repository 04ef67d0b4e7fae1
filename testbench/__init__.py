"""The axes, servos and boards that tests, studies and benchmarks share.

python -m testbench.other_plants -o DIR    sessions of axes that share no code with the toolkit, with truth
"""
