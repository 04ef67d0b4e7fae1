"""Studies over many simulated sessions; they take minutes, write into docs/ and are no tests.

python -m studies.accuracy     errors, intervals and biases of the estimator
"""
