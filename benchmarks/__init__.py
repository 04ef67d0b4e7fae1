"""How fast the toolkit is, against what it could be and against what else a user would write.

python -m benchmarks          everything, into docs/benchmarks.md
python -m benchmarks kernel   some parts only, printed
"""

import os

# before numpy is loaded: one core, whatever the libraries would like
for _name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS"):
    os.environ.setdefault(_name, "1")
