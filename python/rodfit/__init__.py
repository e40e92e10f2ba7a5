"""Slender elastic rods: simulated, and identified from recorded motion.

>>> import rodfit
>>> scene = rodfit.Scene.load("cantilever.toml")
>>> run = scene.simulate(derivatives=["youngs_modulus"])
>>> result = rodfit.Fit.load("cantilever-fit.toml").solve()

All numbers are in SI units.
"""

from ._errors import ComputationError, InputError, RodfitError
from ._fit import Fit
from ._hdf5 import hdf5_to_csv
from ._reports import Design, Prediction
from ._residuals import Residuals
from ._result import FitResult, Parameter
from ._rodfit import __version__
from ._scene import Equilibrium, Modes, Run, Scene
from ._structure import Structure, StructureRun

__all__ = [
    "ComputationError",
    "Design",
    "Equilibrium",
    "Fit",
    "FitResult",
    "InputError",
    "Modes",
    "Parameter",
    "Prediction",
    "Residuals",
    "RodfitError",
    "Run",
    "Scene",
    "Structure",
    "StructureRun",
    "__version__",
    "hdf5_to_csv",
]
