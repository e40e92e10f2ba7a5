"""What came of a fit, in the words of scipy and lmfit."""

from __future__ import annotations

import html
import json
import math
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import numpy as np
    import pandas


class Parameter:
    """An estimate: ``value``, ``stderr``, ``interval`` (95 %), and what else the report says, by attribute."""

    def __init__(self, table: dict[str, Any]):
        self._table = table

    @property
    def name(self) -> str:
        """As the fit names it."""
        return self._table["name"]

    @property
    def value(self) -> float:
        """In SI units; NaN where the data do not determine it."""
        return _number(self._table.get("value"))

    @property
    def stderr(self) -> float:
        """Standard error; NaN where there is none."""
        return _number(self._table.get("std_error"))

    @property
    def interval(self) -> tuple[float, float]:
        """The 95 % interval."""
        ends = self._table.get("interval95")
        return tuple(ends) if ends else (math.nan, math.nan)

    @property
    def identifiable(self) -> bool:
        """Whether the data determine it."""
        return bool(self._table.get("identifiable"))

    def __getattr__(self, name: str) -> Any:
        try:
            return self.__dict__["_table"][name]
        except KeyError:
            raise AttributeError(name) from None

    def __repr__(self) -> str:
        low, high = self.interval
        return f"Parameter({self.name}={self.value:.6g} +- {self.stderr:.2g}, 95 % [{low:.6g}, {high:.6g}])"


class FitResult:
    """The result of a fit. ``params`` are its estimates by name; all else that the JSON of the command has is an
    attribute: ``verdict``, ``grade``, ``warnings``, ``not_identifiable``, ``residual_rms``, ``wall_seconds``."""

    def __init__(self, text: str, words: str):
        self._json = text
        self._words = words
        self._table = json.loads(text)

    @property
    def params(self) -> dict[str, Parameter]:
        """The estimates by name."""
        return {p["name"]: Parameter(p) for p in self._table["parameters"]}

    @property
    def x(self) -> "np.ndarray":
        """The values, in SI units."""
        import numpy as np

        return np.asarray([p.value for p in self.params.values()])

    @property
    def success(self) -> bool:
        """Whether a minimum was reached and all parameters are determined."""
        return bool(self._table["converged"]) and not self._table["not_identifiable"]

    @property
    def message(self) -> str:
        """In one line how the fit ended."""
        return self._table["status"]

    @property
    def correlation(self) -> "np.ndarray":
        """Correlations of the estimates; NaN where one is not identifiable."""
        import numpy as np

        rows = [[_number(c) for c in row] for row in self._table["correlation"]]
        return np.asarray(rows, dtype=float)

    @property
    def covar(self) -> "np.ndarray":
        """Covariances, in SI units, by standard errors and correlations."""
        import numpy as np

        errors = np.asarray([p.stderr for p in self.params.values()])
        return self.correlation * np.outer(errors, errors)

    def __getattr__(self, name: str) -> Any:
        try:
            return self.__dict__["_table"][name]
        except KeyError:
            raise AttributeError(name) from None

    def to_json(self) -> str:
        """What ``rodfit fit --json`` writes."""
        return self._json

    def to_dataframe(self) -> "pandas.DataFrame":
        """A row a parameter: value, stderr, low, high, identifiable."""
        import pandas

        rows = [
            {
                "parameter": p.name,
                "value": p.value,
                "stderr": p.stderr,
                "low": p.interval[0],
                "high": p.interval[1],
                "identifiable": p.identifiable,
            }
            for p in self.params.values()
        ]
        return pandas.DataFrame(rows).set_index("parameter")

    def __str__(self) -> str:
        return self._words

    def __repr__(self) -> str:
        return self._words

    def _repr_html_(self) -> str:
        rows = "".join(
            f"<tr><td>{html.escape(p.name)}</td><td>{p.value:.6g}</td><td>{p.stderr:.2g}</td>"
            f"<td>{p.interval[0]:.6g} to {p.interval[1]:.6g}</td></tr>"
            for p in self.params.values()
        )
        warnings = "".join(f"<li>{html.escape(w)}</li>" for w in self._table["warnings"])
        return (
            f"<p><b>{html.escape(self._table['grade'])}</b>: {html.escape(self._table['verdict'])}</p>"
            "<table><thead><tr><th>parameter</th><th>value</th><th>standard error</th><th>95 %</th></tr></thead>"
            f"<tbody>{rows}</tbody></table>" + (f"<ul>{warnings}</ul>" if warnings else "")
        )

    def __reduce__(self) -> Any:
        return (FitResult, (self._json, self._words))


def _number(value: float | None) -> float:
    return math.nan if value is None else float(value)
