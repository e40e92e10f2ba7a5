"""Residuals of fits with exact derivatives, for the solvers of scipy, lmfit and JAX."""

from __future__ import annotations

from . import _rodfit
from ._errors import refused

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Mapping
    from typing import Any

    import lmfit
    import numpy as np
    from numpy.typing import ArrayLike, NDArray


# Bounds of a positive parameter beyond these are no limits.
SMALLEST, LARGEST = 1e-300, 1e300
# Value of a positive parameter that stands for zero; its derivatives are those at zero.
ZERO = 1e-150


class Residuals:
    """Residuals over their standard deviations, as a function of the parameters in SI units::

        scipy.optimize.least_squares(r, r.x0, jac=r.jac, bounds=r.bounds, x_scale=r.x_scale)
        lmfit.minimize(r, r.to_lmfit(), Dfun=r.jac)

    With ``log=True`` the numbers in ``x`` are the logarithms of positive parameters and the values of others."""

    def __init__(self, native: _rodfit.Residuals, log: bool):
        self._native, self._log = native, log

    @property
    def names(self) -> list[str]:
        """The parameters, in the order of ``x``."""
        return self._native.names

    @property
    def log(self) -> bool:
        """Whether ``x`` has the logarithms of positive parameters."""
        return self._log

    @property
    def x0(self) -> NDArray[np.float64]:
        """Start values."""
        import numpy as np

        starts = self._native.x0
        without = [name for name, x in zip(self.names, starts) if x is None]
        if without:
            raise refused("x0", f"{', '.join(without)} without a start", "add(name, value)")
        return self._to_x(np.asarray(starts, dtype=float))

    @property
    def x_scale(self) -> NDArray[np.float64]:
        """Sizes of the parameters for the steps of a solver: the start value of a positive parameter, 1 for a logarithm. For
        others the larger of the start value and of the change that shifts the residuals by one standard deviation (root
        mean square)."""
        import numpy as np

        x0 = self.x0
        scale = np.where(self._positive & self._log, 1.0, np.abs(x0))
        if not self._positive.all():
            columns = np.sqrt(np.mean(self.jac(x0) ** 2, axis=0))
            changes = np.divide(1.0, columns, out=np.ones_like(columns), where=columns > 0.0)
            scale = np.where(self._positive, scale, np.maximum(scale, changes))
        return np.asarray(scale)

    @property
    def bounds(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Lower and upper bounds; 0 or minus infinity, and infinity, where a side is unlimited."""
        import numpy as np

        low, high = np.asarray(self._native.bounds).T
        # The limits of a number that is only positive are the smallest and largest ones of double precision.
        low = np.where(low < np.where(self._positive, np.log(SMALLEST), -LARGEST), -np.inf, low)
        high = np.where(high > np.where(self._positive, np.log(LARGEST), LARGEST), np.inf, high)
        return self._to_x(low), self._to_x(high)

    def values(self, x: ArrayLike) -> dict[str, float]:
        """The parameters at ``x``, in SI units, by name."""
        return dict(zip(self.names, self._native.values(list(self._to_native(x)))))

    def scaled(self, values: Mapping[str, float]) -> NDArray[np.float64]:
        """The ``x`` of parameters in SI units."""
        import numpy as np

        numbers = np.asarray([float(values[name]) for name in self.names])
        self._check_values("values", numbers)
        return np.asarray(self._native.scaled(numbers.tolist())) if self._log else numbers

    def to_lmfit(self) -> lmfit.Parameters:
        """The parameters with start values and bounds for lmfit, with underscores for other characters in their names."""
        import lmfit

        params = lmfit.Parameters()
        for name, value, low, high in zip(self.names, self.x0, *self.bounds):
            params.add(_identifier(name), value=value, min=low, max=high)
        return params

    def __len__(self) -> int:
        return len(self._native)

    def __call__(self, x: ArrayLike | lmfit.Parameters) -> NDArray[np.float64]:
        return self._native.fun(list(self._to_native(self._array(x))))

    def jac(self, x: ArrayLike | lmfit.Parameters) -> NDArray[np.float64]:
        """Exact derivatives: (residuals, parameters); only by the parameters that vary for those of lmfit."""
        array = self._array(x)
        jacobian: NDArray[np.float64] = self._native.jac(list(self._to_native(array))) * self._slope(array)
        params = _lmfit_parameters(x)
        if params is not None:
            jacobian = jacobian[:, [params[_identifier(name)].vary for name in self.names]]
        return jacobian

    def hess(self, x: ArrayLike) -> NDArray[np.float64]:
        """The exact Hessian of half the sum of squares; positive parameters have to be above 0."""
        import numpy as np

        native, slope = self._to_native(x), self._slope(x)
        if not self._log and (self._array(x)[self._positive] <= ZERO).any():
            raise refused("x", "a positive parameter of 0", "numbers above 0")
        hessian = self._native.hess(list(native))
        if self._log or not self._positive.any():
            return hessian
        # d2f/dx2 by the chain rule for s = ln x: slope H slope - (df/ds)/x2 on the diagonal.
        gradient = self._native.jac(list(native)).T @ self._native.fun(list(native))
        curvature = np.where(self._positive, gradient * slope**2, 0.0)
        return np.asarray(hessian * np.outer(slope, slope) - np.diag(curvature))

    def __repr__(self) -> str:
        scale = "logarithms of positive parameters" if self._log else "SI units"
        return f"Residuals({len(self)} residuals of {', '.join(self.names)}; x in {scale})"

    @property
    def _positive(self) -> NDArray[np.bool_]:
        """Flags of the parameters that are positive."""
        import numpy as np

        return np.asarray(self._native.logarithmic, dtype=bool)

    def _array(self, x: ArrayLike | lmfit.Parameters) -> NDArray[np.float64]:
        """``x`` as an array; parameters of lmfit by their names."""
        import numpy as np

        params = _lmfit_parameters(x)
        values: Any = x if params is None else [params[_identifier(name)].value for name in self.names]
        array = np.atleast_1d(np.asarray(values, dtype=float))
        if array.shape != (len(self.names),):
            allowed = f"shape ({len(self.names)},), one number for each of {', '.join(self.names)}"
            raise refused("x", f"shape {array.shape}", allowed)
        return array

    def _to_native(self, x: ArrayLike) -> NDArray[np.float64]:
        """``x`` with the logarithms of positive parameters."""
        import numpy as np

        x = self._array(x)
        if self._log:
            self._check_finite("x", x)
            return x
        self._check_values("x", x)
        # Zero, as of an absent damping, has no logarithm.
        return np.asarray(np.log(np.maximum(x, ZERO), out=x.copy(), where=self._positive))

    def _check_values(self, key: str, values: NDArray[np.float64]) -> None:
        """Refuses numbers that are not finite, and negative ones of positive parameters."""
        self._check_finite(key, values)
        self._refuse(key, values, self._positive & (values < 0.0), "numbers of 0 or more")

    def _check_finite(self, key: str, values: NDArray[np.float64]) -> None:
        """Refuses numbers that are NaN or infinite."""
        import numpy as np

        self._refuse(key, values, ~np.isfinite(values), "finite numbers")

    def _refuse(self, key: str, values: NDArray[np.float64], bad: NDArray[np.bool_], allowed: str) -> None:
        """Raises an error that names the bad ones of the values."""
        if bad.any():
            found = ", ".join(f"{name} = {value:g}" for name, value, is_bad in zip(self.names, values, bad) if is_bad)
            raise refused(key, found, allowed)

    def _to_x(self, native: NDArray[np.float64]) -> NDArray[np.float64]:
        """The inverse of ``_to_native``."""
        import numpy as np

        return native if self._log else np.asarray(np.exp(native, out=native.copy(), where=self._positive))

    def _slope(self, x: ArrayLike) -> NDArray[np.float64]:
        """Derivatives of the numbers of ``_to_native`` by those of ``x``."""
        import numpy as np

        x = self._array(x)
        if self._log:
            return np.ones(len(x))
        return np.asarray(np.divide(1.0, np.maximum(x, ZERO), out=np.ones_like(x), where=self._positive))


def _lmfit_parameters(x: Any) -> Any:
    """``x`` if it has parameters of lmfit, else None."""
    return x if hasattr(x, "valuesdict") else None


def _identifier(name: str) -> str:
    """The name of a parameter as lmfit takes it: letters, digits and underscores."""
    return "_".join("".join(c if c.isalnum() else " " for c in name).split())
