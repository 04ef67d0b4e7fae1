"""Studies over many simulated sessions; they take minutes, write into docs/ and are no tests.

python -m studies.accuracy     errors, intervals and biases of the estimator
python -m studies.reliability  faults of a servo and its bus, through the real protocol
python -m studies.fuzz         coverage-guided fuzzing of every reader
"""
