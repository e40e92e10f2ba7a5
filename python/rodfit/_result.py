"""Results of fits, with the attribute names of scipy and lmfit."""

from __future__ import annotations

import os

from . import _rodfit
from ._errors import refused
from ._renamed import current_key, warn
from ._tables import read

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Mapping
    from typing import Any

    import numpy as np
    import pandas
    from matplotlib.figure import Figure
    from numpy.typing import NDArray

NAN = float("nan")

# Labels of abscissas with a unit.
ABSCISSAS = {"time": "time, s", "arc_length": "arc length, m", "load": "load, N", "moment": "load, N m"}


class Parameter:
    """An estimate: ``value``, ``stderr``, ``interval`` (95 %). Other entries of the report are attributes."""

    def __init__(self, table: Mapping[str, Any]):
        self._table = table

    @property
    def name(self) -> str:
        """Name in the fit."""
        return str(self._table["name"])

    @property
    def value(self) -> float:
        """Estimate in SI units; NaN if the data do not determine it."""
        return _number(self._table.get("value"))

    @property
    def stderr(self) -> float:
        """Standard error; NaN where there is none."""
        return _number(self._table.get("std_error"))

    @property
    def interval(self) -> tuple[float, float]:
        """The 95 % interval."""
        low, high = self._table.get("interval95") or (NAN, NAN)
        return low, high

    @property
    def identifiable(self) -> bool:
        """Whether the data determine it."""
        return bool(self._table.get("identifiable"))

    def __getattr__(self, name: str) -> Any:
        return _entry(self, name)

    def __dir__(self) -> list[str]:
        return [*super().__dir__(), *self._table]

    def __repr__(self) -> str:
        low, high = self.interval
        return f"Parameter({self.name}={self.value:.6g} +- {self.stderr:.2g}, 95 % [{low:.6g}, {high:.6g}])"


class FitResult:
    """The result of a fit. ``params`` are its estimates by name. All other entries of the JSON of the command are
    attributes: ``verdict``, ``grade``, ``warnings``, ``not_identifiable``, ``residual_rms``, ``wall_seconds``."""

    # Entries of every report, for type checkers.
    grade: str
    interrupted: bool
    not_identifiable: list[Any]
    simulations: float
    verdict: str
    wall_seconds: float
    warning_codes: list[str]
    warnings: list[str]

    def __init__(self, text: str):
        """Reads the text that ``to_json`` returned."""
        self._hold(_rodfit.FitResult(text), None)

    @classmethod
    def _of(cls, native: _rodfit.FitResult, fit: _rodfit.Fit) -> FitResult:
        result = cls.__new__(cls)
        result._hold(native, fit)
        return result

    def _hold(self, native: _rodfit.FitResult, fit: _rodfit.Fit | None) -> None:
        self._native, self._fit = native, fit
        self._report: dict[str, Any] | None = None

    @property
    def _table(self) -> dict[str, Any]:
        """The content of ``to_json``, read when first needed."""
        if self._report is None:
            self._report = dict(read(self._native.json(False)))
        return self._report

    def _drawn(self) -> _rodfit.FitResult:
        """The result with the data of plots; the fit is repeated if they were not kept."""
        if self._native.plots() is None:
            if self._fit is None:
                raise refused("plots", "no plot data in this result", "a result of solve(plots=True)")
            self._native = self._fit.solve(True, None)
        return self._native

    @property
    def params(self) -> dict[str, Parameter]:
        """The estimates by name; those of some experiments only by name and experiments."""
        return {_label(table): Parameter(table) for table in self._table["parameters"]}

    @property
    def x(self) -> NDArray[np.float64]:
        """The values, in SI units."""
        import numpy as np

        return np.asarray([p.value for p in self.params.values()])

    @property
    def success(self) -> bool:
        """Whether the numbers can be used: a minimum was reached, and all parameters are determined."""
        return self._native.success

    @property
    def message(self) -> str:
        """End of the search, in one line."""
        return str(self._table["status"])

    @property
    def resolution(self) -> list[dict[str, Any] | None]:
        """Chosen mesh, step and scheme of each experiment; None for a scene that gives them. Empty if all scenes do."""
        return list(self._table.get("resolution", []))

    @property
    def correlation(self) -> NDArray[np.float64]:
        """Correlations of the estimates; NaN where one is not identifiable."""
        import numpy as np

        rows = [[_number(c) for c in row] for row in self._table["correlation"]]
        return np.asarray(rows, dtype=float)

    @property
    def covar(self) -> NDArray[np.float64]:
        """Covariances, in SI units, by standard errors and correlations."""
        import numpy as np

        errors = np.asarray([p.stderr for p in self.params.values()])
        return np.asarray(self.correlation * np.outer(errors, errors))

    def __getattr__(self, name: str) -> Any:
        if name.startswith("__") or name in ("_native", "_fit", "_report"):
            raise AttributeError(name)
        return _entry(self, name)

    def __dir__(self) -> list[str]:
        return [*super().__dir__(), *self._table]

    def to_json(self) -> str:
        """The JSON that ``rodfit fit --json`` writes."""
        return self._native.json(False)

    def to_dataframe(self) -> pandas.DataFrame:
        """A row a parameter: value, stderr, low, high, identifiable."""
        import pandas

        rows = [
            {
                "parameter": name,
                "value": p.value,
                "stderr": p.stderr,
                "low": p.interval[0],
                "high": p.interval[1],
                "identifiable": p.identifiable,
            }
            for name, p in self.params.items()
        ]
        return pandas.DataFrame(rows).set_index("parameter")

    def draws(self) -> pandas.DataFrame:
        """A row a draw from the posterior distribution: chain, draw, the parameters in SI units, and lp, the log density.
        ``solve(posterior={"draws": 1000})`` samples it; results that are read from JSON have none."""
        import io

        import pandas

        text = self._native.draws()
        if text is None:
            raise refused("posterior", "no draws in this result", 'a result of solve(posterior={"draws": 1000})')
        return pandas.read_csv(io.StringIO(text), float_precision="round_trip")

    def report(self, path: str | os.PathLike[str] = "fit.html", title: str | None = None) -> None:
        """Writes the HTML page of the command's ``--report``."""
        page = self._drawn().page(os.path.basename(path) if title is None else title)
        with open(path, "w", encoding="utf-8") as file:
            file.write(page)

    def plot(self, figure: Figure | None = None) -> Figure:
        """Plots data and model of each coordinate, with the residuals below, as a figure of matplotlib."""
        series = read(self._drawn().plots() or "{}").get("series", [])
        if figure is None:
            import matplotlib.pyplot as plt

            figure = plt.figure(layout="constrained")
        axes = figure.subplots(2 * max(1, len(series)), 1, squeeze=False, height_ratios=[3, 1] * max(1, len(series)))
        for (data, left), one in zip(axes.reshape(-1, 2), series):
            data.plot(one["abscissa_values"], one["observed"], ".", ms=3, label="observed")
            line = list(zip(*one["curve"])) or [one["abscissa_values"], one["simulated"]]
            data.plot(line[0], line[1], lw=1, label="model")
            data.set_ylabel(f"{one['axis']}, {one['unit']}")
            data.set_title(" ".join(word for word in (one["experiment"], one["label"]) if word), fontsize="small")
            data.tick_params(labelbottom=False)
            left.sharex(data)
            left.axhline(0.0, lw=0.5, color="gray")
            off = [(s - o) / one["sigma"] for s, o in zip(one["simulated"], one["observed"])]
            left.plot(one["abscissa_values"], off, ".", ms=2)
            left.set_ylabel("residual, sigma")
            left.set_xlabel(ABSCISSAS.get(one["abscissa"], one["abscissa"].replace("_", " ")))
        if series:
            axes[0, 0].legend(fontsize="small")
        return figure

    def __str__(self) -> str:
        return self._native.words()

    def __repr__(self) -> str:
        return self._native.words()

    def _repr_html_(self) -> str:
        import html

        rows = "".join(
            f"<tr><td>{html.escape(name)}</td><td>{p.value:.6g}</td><td>{p.stderr:.2g}</td>"
            f"<td>{p.interval[0]:.6g} to {p.interval[1]:.6g}</td></tr>"
            for name, p in self.params.items()
        )
        warnings = "".join(f"<li>{html.escape(w)}</li>" for w in self._table["warnings"])
        return (
            f"<p><b>{html.escape(self._table['grade'])}</b>: {html.escape(self._table['verdict'])}</p>"
            "<table><thead><tr><th>parameter</th><th>value</th><th>standard error</th><th>95 %</th></tr></thead>"
            f"<tbody>{rows}</tbody></table>" + (f"<ul>{warnings}</ul>" if warnings else "")
        )

    def __reduce__(self) -> Any:
        return (FitResult, (self._native.json(True),))


def _entry(self: Any, name: str) -> Any:
    """An entry of a table, by attribute; former names too."""
    table: Mapping[str, Any] = self._table if name != "_table" else {}
    if name in table:
        return table[name]
    current = current_key(table, name)
    if current is None:
        raise AttributeError(f"no {name}, allowed: {', '.join(table)}")
    warn(name, current, stacklevel=4)
    return table[current]


def _label(table: Mapping[str, Any]) -> str:
    experiments = table.get("experiments")
    return f"{table['name']} ({', '.join(experiments)})" if experiments else str(table["name"])


def _number(value: float | None) -> float:
    return NAN if value is None else float(value)
