"""Slender elastic rods: simulated, and identified from recorded motion.

>>> import rodfit
>>> scene = rodfit.Scene.load("cantilever.toml")
>>> run = scene.simulate(derivatives=["youngs_modulus"])
>>> result = rodfit.Fit.load("cantilever-fit.toml").solve()

All numbers are in SI units.
"""

from ._errors import ComputationError, InputError, RodfitError
from ._fit import Fit, Residuals
from ._result import FitResult, Parameter
from ._rodfit import __version__
from ._scene import Equilibrium, Modes, Run, Scene
from ._structure import Structure, StructureRun

__all__ = [
    "ComputationError",
    "Equilibrium",
    "Fit",
    "FitResult",
    "InputError",
    "Modes",
    "Parameter",
    "Residuals",
    "RodfitError",
    "Run",
    "Scene",
    "Structure",
    "StructureRun",
    "__version__",
]
