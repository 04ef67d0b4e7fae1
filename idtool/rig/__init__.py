"""Rigs: the axis that recipes and the controller drive.

`open_rig` turns a word such as "sim:paper" into one; `named_rigs` lists those that come with the
package. The interface of every rig is in `base`.
"""

from idtool.rig.opening import RigKind, forms, named_rigs, open_rig

__all__ = ["RigKind", "forms", "named_rigs", "open_rig"]
