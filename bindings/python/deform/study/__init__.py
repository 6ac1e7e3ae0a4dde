"""Studies: a scene or a rig over ranges of its values (sweep), and its values from measured curves (fit)."""
from .export import export
from .fit import Fit, fit
from .sweep import Sweep, sweep

__all__ = ["Fit", "Sweep", "export", "fit", "sweep"]
