"""The study of hand guiding: the law at the gain of `tune` on the guided machines of the testbench.

`axes` runs every hand on every day of a machine; `page` writes docs/teach.md.
"""
