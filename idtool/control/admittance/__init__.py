"""The admittance law of mode "light": docs/teach.md explains it on one page."""

from idtool.control.admittance.law import AdmittanceLaw, AdmittanceSettings

__all__ = ["AdmittanceLaw", "AdmittanceSettings"]
