"""Fits of parameters to what was measured."""

from __future__ import annotations

import json
import os
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Sequence

from . import _rodfit
from ._result import FitResult
from ._rodfit import InputError
from ._scene import Scene

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import ArrayLike


@dataclass(frozen=True)
class Experiment:
    """A scene under a name, of several that share parameters."""

    name: str
    scene: Scene


class Fit:
    """An identification in the making: of a scene, or of experiments."""

    def __init__(self, scene: Scene | Experiment | Sequence[Experiment]):
        if isinstance(scene, Scene):
            scene = Experiment("", scene)
        experiments = [scene] if isinstance(scene, Experiment) else list(scene)
        self._native = _rodfit.Fit([(e.name, e.scene._native) for e in experiments])

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> "Fit":
        """The fit of a TOML file."""
        return cls._of(_rodfit.Fit.load(os.fspath(path)))

    @classmethod
    def from_toml(cls, text: str, folder: str | os.PathLike[str] = ".") -> "Fit":
        """The fit of a TOML text; files in it are relative to ``folder``."""
        return cls._of(_rodfit.Fit.from_toml(text, os.fspath(folder)))

    @classmethod
    def _of(cls, native: _rodfit.Fit) -> "Fit":
        fit = cls.__new__(cls)
        fit._native = native
        return fit

    def observe(
        self,
        t: "ArrayLike",
        xyz: "ArrayLike",
        at: str | int | dict[str, float] = "tip",
        sigma: float | None = None,
        loss: str = "squares",
    ) -> "Fit":
        """Adds what was seen of a point: times, s, and places, m, one row a time with one to three columns x, y, z; NaN
        where it was not seen. ``at`` is "tip", a node, or {"arc_length": metres from the wall}; ``sigma`` the noise of a
        coordinate, m, estimated where it is not given."""
        import numpy as np

        times = np.ascontiguousarray(t, dtype=float)
        places = np.ascontiguousarray(xyz, dtype=float)
        if places.ndim == 1:
            places = places[:, None]
        if times.ndim != 1 or places.ndim != 2:
            raise InputError(f"xyz: found {places.ndim} dimensions beside {times.ndim}, allowed: (n, 3) beside (n,)")
        self._native.observe(times, places, json.dumps(at), sigma, json.dumps(loss))
        return self

    def add(
        self,
        name: str,
        value: float | None = None,
        *,
        min: float | None = None,
        max: float | None = None,
        prior: tuple[float, float] | None = None,
    ) -> "Fit":
        """Adds a parameter to identify. ``value`` is where the search starts, by default from wherever it may be;
        ``prior`` its mean and standard deviation."""
        bounds = None
        if min is not None or max is not None:
            bounds = (float("-inf") if min is None else min, float("inf") if max is None else max)
        self._native.add(name, value, bounds, prior)
        return self

    def solve(self, **analysis: Any) -> FitResult:
        """Finds the parameters. ``analysis`` is what the fit file's table of that name may hold: ``profile=True``,
        ``bootstrap=1000``. Other threads go on meanwhile; Ctrl-C ends it with the best so far."""
        if analysis:
            self._native.analyse(json.dumps(analysis))
        return FitResult(*self._native.solve())

    def residuals(self) -> "Residuals":
        """The residuals with their exact derivatives, for other solvers."""
        return Residuals(self._native.residuals())


class Residuals:
    """Residuals in units of their noise, as ``scipy.optimize.least_squares(r, r.x0, jac=r.jac, bounds=r.bounds)`` takes
    them. ``x`` is on the solver's scale: the logarithm of positive parameters."""

    def __init__(self, native: _rodfit.Residuals):
        self._native = native

    @property
    def names(self) -> list[str]:
        """The parameters, in the order of ``x``."""
        return self._native.names

    @property
    def x0(self) -> "np.ndarray":
        """Where the parameters start."""
        import numpy as np

        starts = self._native.x0
        without = [name for name, x in zip(self.names, starts) if x is None]
        if without:
            raise InputError(f"x0: {', '.join(without)} without a start, allowed: add(name, value)")
        return np.asarray(starts)

    @property
    def bounds(self) -> tuple["np.ndarray", "np.ndarray"]:
        """Lower and upper ends."""
        import numpy as np

        low, high = zip(*self._native.bounds)
        return np.asarray(low), np.asarray(high)

    def values(self, x: "ArrayLike") -> dict[str, float]:
        """Parameters in SI units."""
        return dict(zip(self.names, self._native.values(list(map(float, x)))))  # type: ignore[arg-type]

    def scaled(self, values: dict[str, float]) -> "np.ndarray":
        """From parameters in SI units to the solver's scale."""
        import numpy as np

        return np.asarray(self._native.scaled([float(values[name]) for name in self.names]))

    def __call__(self, x: "ArrayLike") -> "np.ndarray":
        return self._native.fun(list(map(float, x)))  # type: ignore[arg-type]

    def jac(self, x: "ArrayLike") -> "np.ndarray":
        """Exact derivatives: (residuals, parameters)."""
        return self._native.jac(list(map(float, x)))  # type: ignore[arg-type]

    def hess(self, x: "ArrayLike") -> "np.ndarray":
        """The exact Hessian of half the sum of squares."""
        return self._native.hess(list(map(float, x)))  # type: ignore[arg-type]
