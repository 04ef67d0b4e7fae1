"""How fast the toolkit is, against what it could be and against what else a user would write.

python -m benchmarks          everything, into docs/benchmarks.md
python -m benchmarks kernel   some parts only, printed
"""
