"""Studies over many simulated sessions; they take minutes, write into docs/ and are no tests.

python -m studies.accuracy     errors, intervals and biases of the estimator
python -m studies.diagnosis    what the diagnosis names, and what it names that is not there
python -m studies.measured     recordings of real machines beside what their sources published
python -m studies.guiding      light hand guiding over many axes, hands kind and unkind
python -m studies.board        what the exported C costs on a simulated Arduino Uno
python -m studies.reliability  faults of a servo and its bus, through the real protocol
python -m studies.fuzz         coverage-guided fuzzing of every reader
"""
