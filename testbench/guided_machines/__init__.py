"""Guided machines of another kind: an independent plant, and hands kind and unkind.

`plant` shares no formula with the law, with the estimator or with the simulated rig of the package: another
integrator, other friction laws, another drive. `machines` draws axes, records a session on each, and
identifies it; `hands` writes what hands do; `session` runs the law on the plant; `figures` judges what the
plant then did.
"""
