"""Fits of parameters to measurements."""

from __future__ import annotations

import os
import sys

from . import _rodfit
from ._errors import check_path, refused
from ._renamed import warn
from ._reports import Design, Prediction
from ._residuals import Residuals
from ._result import FitResult
from ._scene import Scene
from ._structure import Structure
from ._tables import is_table, written

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence
    from typing import Any

    import numpy as np
    from numpy.typing import ArrayLike, NDArray

    Progress = Callable[[str, float], object]

# Names of the time column of a DataFrame.
TIMES = ("t", "time")
INFINITY = float("inf")


def _checked(scene: Scene | Structure) -> Scene | Structure:
    """The scene or structure; an error for another object."""
    if not isinstance(scene, (Scene, Structure)):
        raise refused("scene", repr(scene)[:80], "a rodfit.Scene or rodfit.Structure. Read a fit file with Fit.load")
    return scene


class Fit:
    """A fit under construction, of one scene or of several experiments::

        fit = rodfit.Fit(scene).observe(t, xyz, at="tip").add("youngs_modulus")

        fit = rodfit.Fit()
        fit.experiment("long", long_scene).observe(t, xyz)
        fit.experiment("short", short_scene).frequencies(hz=[4.2], sigma=0.02)
        fit.add("youngs_modulus").add("supports.start.angle", experiment="long")

    Keywords have the meaning of the keys of the fit file."""

    def __init__(self, scene: Scene | Structure | None = None):
        self._native = _rodfit.Fit([], []) if scene is None else _rodfit.Fit([""], [_checked(scene)._native])

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> Fit:
        """The fit of a TOML file."""
        check_path("path", path, "Fit.from_toml")
        return cls._of(_rodfit.Fit.load(os.fspath(path)))

    @classmethod
    def from_toml(cls, text: str, folder: str | os.PathLike[str] = ".") -> Fit:
        """The fit of a TOML text; files in it are relative to ``folder``."""
        return cls._of(_rodfit.Fit.from_toml(text, os.fspath(folder)))

    @classmethod
    def load_plan(cls, path: str | os.PathLike[str]) -> Fit:
        """The plan of a TOML file for ``design``: its measurements may have a duration and a rate instead of data."""
        return cls._of(_rodfit.Fit.load_plan(os.fspath(path)))

    @classmethod
    def _of(cls, native: _rodfit.Fit) -> Fit:
        fit = cls.__new__(cls)
        fit._native = native
        return fit

    def experiment(self, name: str, scene: Scene | Structure) -> Fit:
        """Adds an experiment, to which all later measurements belong."""
        self._native.experiment(name, _checked(scene)._native)
        return self

    def observe(
        self,
        t: ArrayLike | str | os.PathLike[str] | Any,
        xyz: ArrayLike | None = None,
        at: str | int | Mapping[str, Any] = "tip",
        sigma: float | ArrayLike | str | Mapping[str, str] | None = None,
        loss: str = "squares",
        held_out: bool = False,
        **recording: Any,
    ) -> Fit:
        """Adds the observed motion of a point of the rod.

        ``t`` is an array of times, s, and ``xyz`` an array of positions, m, with a row for each time and one to three
        columns x, y, z; missing positions are NaN. Or ``t`` is a DataFrame with some of the columns x, y, z, and with the
        times in a column t or as its index. Or ``t`` is a file, with ``marker``, ``fps``, ``scale``, ``origin``, ``y`` and
        the other keys of ``[[observation]]``.

        ``at`` is "tip", the index of a node, or {"arc_length": meters from the wall}; of a structure {"rod": name, "at": ..}
        or {"body": name}. ``sigma`` is the standard deviation
        of a coordinate, m, or an array with one for each time; for a file also the name of a column, or {"x": .., "y": ..}
        with those of the axes. It is estimated if it is not given. ``loss`` is "squares", "huber", "soft-l1" or "cauchy".
        ``held_out`` data are validation data: they are predicted, not fitted."""
        if isinstance(t, (str, os.PathLike)):
            if xyz is not None:
                raise refused("xyz", "both numbers and a file", "one of the two")
            # The key `markers` gives the points of several markers, `of` the support of a sensor.
            point = None if {"markers", "of"} & recording.keys() else at
            keys = {"file": t, "point": point, "sigma": sigma, "loss": loss, "held_out": held_out}
            return self._add("observation", keys | recording)
        if recording:
            allowed = "only at, sigma, loss and held_out together with numbers; other keys of an observation belong to a file"
            raise refused(next(iter(recording)), "an argument", allowed)
        if xyz is None:
            t, xyz = _columns(t)
        self._check_experiment()
        import numpy as np

        times, positions = _seconds("t", t), _numbers("xyz", xyz)
        if positions.ndim == 1:
            positions = positions[:, None]
        if times.ndim != 1 or positions.ndim != 2:
            found = f"{positions.ndim} dimensions for times of {times.ndim}"
            raise refused("xyz", found, "positions of shape (n, 3) for times of shape (n,)")
        if isinstance(sigma, str) or is_table(sigma):
            raise refused("sigma", f"{sigma!r} together with numbers", "a number, or one number for each time; column names belong to a file")
        noise = np.atleast_1d(_numbers("sigma", [] if sigma is None else sigma))
        if noise.ndim != 1:
            raise refused("sigma", f"an array of shape {noise.shape}", "a number, or one number for each time")
        self._native.observe(times, positions, written(at, "at"), noise.tolist(), written(loss, "loss"), held_out)
        return self

    def plan(self, *, duration: float, fps: float, at: str | int | Mapping[str, Any] = "tip", sigma: float, **keys: Any) -> Fit:
        """Adds a planned observation for ``design``: the motion of the point ``at`` over a duration, s, with a frame rate, 1/s,
        and a standard deviation, m. The other keys are those of ``[[observation]]`` in a plan, such as ``axes``."""
        return self._add("observation", {"point": at, "duration": duration, "fps": fps, "sigma": sigma} | keys)

    def shape(self, file: str | os.PathLike[str], **keys: Any) -> Fit:
        """Adds a measured shape at rest from a file, with the keys of ``[[shape]]``, such as ``sigma``, ``scale`` and ``origin``."""
        return self._add("shape", {"file": file} | keys)

    def frequencies(self, hz: Sequence[float] | None = None, *, sigma: float, **keys: Any) -> Fit:
        """Adds measured natural frequencies: ``hz``, or ``rad_s``, with ``sigma`` in the same unit, and the other keys of
        ``[[frequencies]]``, such as ``modes`` and ``plane``."""
        return self._add("frequencies", {"hz": hz, "sigma": sigma} | keys)

    def load_deflection(self, load: str, file: str | os.PathLike[str], **keys: Any) -> Fit:
        """Adds displacements of a point at rest under several values of a ``load``, such as ``"loads.point.0.force.y"``, from a
        file, with the keys of ``[[load_deflection]]``, such as ``sigma`` and ``load_factor``."""
        return self._add("load_deflection", {"load": load, "file": file} | keys)

    def buckling(self, load: str, value: float, *, sigma: float, **keys: Any) -> Fit:
        """Adds the measured critical ``value`` of a ``load``, such as ``"loads.point.0.force.x"``, N or N m."""
        return self._add("buckling", {"load": load, "value": value, "sigma": sigma} | keys)

    def add(
        self,
        name: str,
        value: float | None = None,
        *,
        min: float | None = None,
        max: float | None = None,
        prior: tuple[float, float] | None = None,
        vary: bool = True,
        experiment: str | Sequence[str] | None = None,
    ) -> Fit:
        """Adds a parameter to identify. ``value`` is its start value; without one, its whole range is searched. ``prior`` is
        the mean and the standard deviation of independent knowledge. ``experiment`` lists the experiments that share the
        parameter, by default all. With ``vary=False`` the parameter is fixed at ``value`` instead of the scene's."""
        low, high = _rodfit.limits(name)
        keys: dict[str, Any] = {"name": name}
        if value is not None:
            keys["start" if vary else "fixed"] = _number("value", value)
        elif not vary:
            raise refused("value", "none", "a number, as vary=False")
        if min is not None or max is not None:
            # An infinite bound is none.
            bounds = (low if min is None else _number("min", min), high if max is None else _number("max", max))
            keys["bounds"] = [low if bounds[0] == -INFINITY else bounds[0], high if bounds[1] == INFINITY else bounds[1]]
        if prior is not None:
            both = list(prior) if hasattr(prior, "__iter__") else []
            if len(both) != 2:
                raise refused("prior", repr(prior), "mean and standard deviation, as in (1e8, 1e6)")
            keys["prior"] = {"mean": _number("prior", both[0]), "sigma": _number("prior", both[1])}
        return self._add("parameter", keys | {"experiment": experiment})

    def input_uncertainty(self, name: str, sigma: float, **keys: Any) -> Fit:
        """States the standard uncertainty of an input, a number of the scenes that is not identified, in its unit. It
        enters the uncertainty budget. The other keys are those of ``[[known]]``."""
        return self._add("known", {"name": name, "sigma": sigma} | keys)

    def known(self, name: str, sigma: float, **keys: Any) -> Fit:
        """Former name of ``input_uncertainty``, deprecated."""
        warn("Fit.known", "Fit.input_uncertainty")
        return self.input_uncertainty(name, sigma, **keys)

    def _add(self, table: str, keys: Mapping[str, Any]) -> Fit:
        """Adds a table of a fit file with the keys that have a value."""
        if table not in ("parameter", "known"):
            self._check_experiment()
        given = {key: value for key, value in keys.items() if value is not None}
        self._native.add(f'{{"{table}": [{written(given, table)}]}}', "")
        return self

    def _check_experiment(self) -> None:
        """An error before the first experiment, to which measurements belong."""
        if not self._native.summary()[1]:
            raise refused("experiment", "none", "Fit(scene), or fit.experiment(name, scene) before its measurements")

    def solve(self, *, progress: bool | Progress = False, plots: bool = False, **analysis: Any) -> FitResult:
        """Estimates the parameters.

        ``progress`` is called with the stage and the work so far, in simulations; True prints them. ``plots`` keeps the
        data of ``result.plot()`` and ``result.report()``; without it these repeat the fit. The other keywords are those of
        the fit file's ``[analysis]``: ``profile=True``, ``bootstrap=1000``, ``posterior={"draws": 1000}``,
        ``tolerance=1e-6``.

        Other threads continue. Ctrl-C stops the fit, which then returns its best values with ``result.interrupted``."""
        callback = _ProgressLine() if progress is True else progress or None
        if not (callback is None or callable(callback)):
            raise refused("progress", repr(progress), "True, or a function of the stage and the simulations so far")
        fit = self._native.snapshot()
        if analysis:
            fit.add(written({"analysis": analysis}), "")
        try:
            return FitResult._of(fit.solve(plots, callback), fit)
        finally:
            if isinstance(callback, _ProgressLine):
                callback.clear()

    def residuals(self, *, log: bool = False, mesh_of: FitResult | None = None) -> Residuals:
        """The residuals with their exact derivatives, for other solvers, as functions of the parameters in SI units. With
        ``log=True`` positive parameters are replaced by their logarithms. Mesh and step are those of the scenes;
        ``mesh_of`` is a result of this fit whose mesh and step are used instead."""
        if not (mesh_of is None or isinstance(mesh_of, FitResult)):
            raise refused("mesh_of", type(mesh_of).__name__, "a result of solve")
        return Residuals(self._native.residuals(None if mesh_of is None else mesh_of._native), log)

    def design(self) -> Design:
        """The expected uncertainties of the parameters, before anything is recorded or with existing data, of which only the
        times are used. They are evaluated at the start values, or else at the values of the scenes."""
        return Design(self._native.design())

    def predict(self, *, plots: bool = False) -> Prediction:
        """Compares the scenes, with their own values, with all measurements; nothing is fitted. ``plots`` keeps the data of the
        plots in ``report()``."""
        self._check_experiment()
        return Prediction(self._native.predict(plots))

    def __repr__(self) -> str:
        names, measurements = self._native.summary()
        experiments = "" if len(measurements) == 1 else f" of {len(measurements)} experiments"
        count = f"{sum(measurements)} measurement{'' if sum(measurements) == 1 else 's'}"
        return f"Fit({', '.join(names) or 'no parameters'}; {count}{experiments})"

    def __copy__(self) -> Fit:
        return Fit._of(self._native.snapshot())

    def __deepcopy__(self, memo: object) -> Fit:
        return self.__copy__()


class _ProgressLine:
    """Prints progress on one line of the terminal."""

    def __call__(self, stage: str, simulations: float) -> None:
        text = f"{stage} ({simulations:.1f} simulations)"
        print(f"\r{text:<70}", end="", file=sys.stderr, flush=True)

    def clear(self) -> None:
        print(f"\r{'':<70}\r", end="", file=sys.stderr, flush=True)


def _columns(frame: Any) -> tuple[Any, Any]:
    """Times, s, and positions, m, of a DataFrame."""
    names = [str(name) for name in getattr(frame, "columns", ())]
    axes = [axis for axis in "xyz" if axis in names]
    if not axes:
        allowed = "times and places: two arrays, a DataFrame with columns t, x, y, z, or a file"
        raise refused("data", f"a {type(frame).__name__} of columns {names}" if names else type(frame).__name__, allowed)
    times = next((name for name in TIMES if name in names), None)
    import numpy as np

    clock = _seconds("t", frame.index if times is None else frame[times])
    # Missing columns before the last axis are NaN.
    positions = np.full((len(clock), "xyz".index(axes[-1]) + 1), np.nan)
    for axis in axes:
        positions[:, "xyz".index(axis)] = _numbers(axis, frame[axis])
    return clock, positions


def _number(key: str, value: Any) -> float:
    """A number; an error for another object."""
    if isinstance(value, (bool, str)) or not hasattr(value, "__float__") or getattr(value, "ndim", 0) > 0:
        raise refused(key, repr(value), "a number")
    return float(value)


def _numbers(key: str, values: Any) -> NDArray[np.float64]:
    """Numbers as an array, masked ones as NaN; an error for what is not a real number."""
    import numpy as np

    try:
        if np.asarray(values).dtype.kind in "cmM":
            raise TypeError
        array = np.ascontiguousarray(values, dtype=float)
    except (TypeError, ValueError):
        raise refused(key, f"{type(values).__name__} {repr(values)[:60]}", "an array of real numbers") from None
    # A copy: the array may be a view of the caller's.
    return np.where(np.ma.getmaskarray(values), np.nan, array) if hasattr(values, "filled") else array


def _seconds(key: str, times: Any) -> NDArray[np.float64]:
    """Times as an array, s; an error for dates."""
    import numpy as np

    kind = getattr(getattr(times, "dtype", None), "kind", "")
    if kind == "M":
        raise refused(key, "dates", "seconds since the start of the scene, or time differences, as t - t[0]")
    return _numbers(key, np.asarray(times) / np.timedelta64(1, "s") if kind == "m" else times)
