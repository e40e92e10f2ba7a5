"""Scenes, and what is computed of them."""

from __future__ import annotations

import os
import sys

from . import _rodfit
from ._errors import check_count, check_path, refused
from ._tables import is_table, read, written

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping
    from typing import Any

    import numpy as np
    import xarray
    from numpy.typing import ArrayLike, NDArray

# Energies of a run, in the order of their columns.
ENERGIES = ("kinetic", "stretch", "bend", "twist", "potential")


class _Table:
    """A JSON table, its entries as attributes."""

    #: Entries that the table may lack, with their values then.
    _absent: Mapping[str, Any] = {}

    def __init__(self, table: Mapping[str, Any]):
        self._table = dict(table)

    def __getattr__(self, name: str) -> Any:
        table = self.__dict__.get("_table", {})
        try:
            return table[name] if name in table else type(self)._absent[name]
        except KeyError:
            known = ", ".join(dict.fromkeys([*table, *type(self)._absent]))
            raise AttributeError(f"no {name}, allowed: {known}") from None

    def __dir__(self) -> list[str]:
        return [*super().__dir__(), *self._table, *self._absent]

    def to_dict(self) -> dict[str, Any]:
        """The table itself."""
        return dict(self._table)


class Equilibrium(_Table):
    """A rod at rest: ``nodes`` (m), ``tip`` (m), ``stable``, ``stable_in_plane``, ``energies`` (J), ``reactions``
    (N, N m), and ``mesh_error`` of a given mesh (``displacement`` in m, ``relative``)."""

    _absent = {"stable_in_plane": None, "resolution": None, "mesh_error": None, "warnings": (), "warning_codes": ()}

    @property
    def stable(self) -> bool | None:
        """Whether no examined direction lowers the energy. A planar scene without ``shear_modulus`` and
        ``poisson_ratio`` is examined in its plane only. None with loads without a potential, which are not examined."""
        stable = self._table.get("stable", self._table.get("stable_in_plane"))
        return None if stable is None else bool(stable)

    @property
    def tip(self) -> NDArray[np.float64]:
        """Position of the last node, m: (3,)."""
        import numpy as np

        return np.asarray(self._table["tip"])

    @property
    def nodes(self) -> NDArray[np.float64]:
        """Places of the nodes, m: (nodes, 3)."""
        import numpy as np

        return np.asarray(self._table["nodes"])

    def __repr__(self) -> str:
        is_planar = "stable" not in self._table and self._table.get("stable_in_plane") is not None
        plane = ", examined in its plane only" if is_planar else ""
        return f"Equilibrium(tip={self._table['tip']}, stable={self.stable}{plane})"


class Modes(_Table):
    """Small vibrations: ``frequencies_hz``, ``modes`` with their shapes, ``unstable``."""

    _absent = {"resolution": None, "warnings": (), "warning_codes": ()}

    @property
    def frequencies_hz(self) -> NDArray[np.float64]:
        """Frequencies, ascending, Hz; unstable directions as minus their growth rates."""
        import numpy as np

        return np.asarray(self._table["frequencies_rad_s"]) / (2 * np.pi)

    def __repr__(self) -> str:
        return f"Modes({len(self._table['modes'])} modes, {self._table['unstable']} unstable)"


class Run:
    """A simulated motion: ``t``, s; ``position``, m, and ``velocity``, m/s: (times, nodes, 3), views that cannot be
    written to."""

    def __init__(self, native: _rodfit.Run):
        self._native = native
        self.t: NDArray[np.float64] = native.t
        self.t.flags.writeable = False
        self._motion = native.motion
        self._motion.flags.writeable = False
        self._derivatives = dict(zip(native.names, native.derivatives))
        self._energies = native.energies
        for array in (self._energies, *self._derivatives.values()):
            array.flags.writeable = False

    @property
    def resolution(self) -> dict[str, Any] | None:
        """Mesh, step and scheme of this run, and the estimated error, where the program chose them. They are finer than those
        of ``Scene.resolution`` where the run was repeated."""
        text = self._native.resolution()
        return None if text is None else dict(read(text))

    @property
    def warnings(self) -> list[str]:
        """Warnings of the scene and of the estimated error of this run."""
        return self._native.warnings()

    @property
    def position(self) -> NDArray[np.float64]:
        """Places of all nodes, m: (times, nodes, 3)."""
        return self._motion[:, :, 0, :]

    @property
    def velocity(self) -> NDArray[np.float64]:
        """Velocities of all nodes, m/s: (times, nodes, 3)."""
        return self._motion[:, :, 1, :]

    @property
    def derivative(self) -> dict[str, NDArray[np.float64]]:
        """Derivatives of the places by every parameter that was asked for, m over its unit."""
        return {name: array[:, :, 0, :] for name, array in self._derivatives.items()}

    @property
    def tip(self) -> NDArray[np.float64]:
        """Places of the rod's end, m: (times, 3). It is the last node, or the wall that holds this end between two nodes."""
        return self.at("tip")

    @property
    def energy(self) -> dict[str, NDArray[np.float64]]:
        """Energies at every time, J: ``kinetic``, ``stretch``, ``bend``, ``twist``, ``potential`` of the loads, and their
        sum, ``total``."""
        terms = dict(zip(ENERGIES, self._energies.T))
        return terms | {"total": self._energies.sum(axis=1)}

    @property
    def arc_length(self) -> NDArray[np.float64]:
        """Arc lengths of the nodes from the wall, m: (nodes,)."""
        import numpy as np

        return np.asarray(self._native.arc_length())

    def at(
        self,
        point: str | int | Mapping[str, float] = "tip",
        t: ArrayLike | None = None,
        *,
        derivative: str | None = None,
    ) -> NDArray[np.float64]:
        """The position of a point of the rod, m: "tip", a node, or {"arc_length": meters from the wall}. At a time ``t``, s:
        (3,); at several: (times, 3); by default at all times of the run. Between steps it is the cubic with their positions
        and velocities, as in a fit. With ``derivative``, the name of a parameter of ``simulate(derivatives=..)``, it is the
        exact derivative of that position by the parameter."""
        import numpy as np

        source = self._motion
        if derivative is not None:
            if derivative not in self._derivatives:
                known = ", ".join(self._derivatives) or "none; name the parameter in simulate(derivatives=..)"
                raise refused("derivative", derivative, known)
            source = self._derivatives[derivative]
        nodes, weights = self._native.stencil(written(point, "point"))
        motion: NDArray[np.float64] = np.einsum("tnmc,n->mtc", source[:, nodes], weights)
        if t is None:
            return np.asarray(motion[0])
        asked = np.asarray(t, dtype=float)
        end = self.t[-1]
        outside = asked[~((asked >= 0.0) & (asked <= end * (1 + 1e-9)))]
        if outside.size:
            raise refused("t", f"{outside[0]:g}", f"0 .. {end:g}, the times of the run")
        after = np.clip(np.searchsorted(self.t, asked, side="right"), 1, len(self.t) - 1)
        step = (self.t[after] - self.t[after - 1])[..., None]
        u = np.clip((asked - self.t[after - 1])[..., None] / step, 0.0, 1.0)
        (x0, v0), (x1, v1) = (motion[:, k] for k in (after - 1, after))
        place = x0 + u * u * (3 - 2 * u) * (x1 - x0) + step * u * (1 - u) * ((1 - u) * v0 - u * v1)
        return np.asarray(place)

    def to_xarray(self) -> xarray.Dataset:
        """The run as a Dataset of xarray: ``position``, ``velocity`` and a derivative for each parameter over ``time``,
        ``node`` and ``axis``; energies over ``time`` and ``term``."""
        import xarray

        over = ("time", "node", "axis")
        arrays = {
            "position": (over, self.position, {"units": "m"}),
            "velocity": (over, self.velocity, {"units": "m/s"}),
            "energy": (("time", "term"), self._energies, {"units": "J"}),
        }
        for name, array in self.derivative.items():
            arrays[f"d_position_d_{name}"] = (over, array, {"long_name": f"derivative of position by {name}"})
        coordinates = {
            "time": ("time", self.t, {"units": "s"}),
            "arc_length": ("node", self.arc_length, {"units": "m"}),
            "axis": list("xyz"),
            "term": list(ENERGIES),
        }
        return xarray.Dataset(arrays, coordinates)

    def __len__(self) -> int:
        return len(self.t)

    def __repr__(self) -> str:
        times, nodes = self._motion.shape[:2]
        return f"Run({times} times to {self.t[-1]:g} s, {nodes} nodes)"


class Scene:
    """A scene, read and validated; it cannot be changed, ``replace`` and ``with_values`` make others."""

    def __init__(self, scene: Mapping[str, Any] | str | os.PathLike[str] | _rodfit.Scene, folder: str | os.PathLike[str] = "."):
        """The scene of a table as the file has it, or of a TOML file. Files that a table names are relative to ``folder``."""
        if is_table(scene):
            scene = _rodfit.Scene.from_json(written(scene), os.fspath(folder))
        elif isinstance(scene, (str, os.PathLike)):
            check_path("scene", scene, "Scene.from_toml")
            folder = os.path.dirname(os.path.abspath(scene))
            scene = _rodfit.Scene.load(os.fspath(scene))
        elif not isinstance(scene, _rodfit.Scene):
            raise refused("scene", type(scene).__name__, "a table, or the name of a TOML file")
        self._native = scene
        self._folder = os.fspath(folder)

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> Scene:
        """The scene of a TOML file."""
        return cls(path)

    @classmethod
    def from_toml(cls, text: str, folder: str | os.PathLike[str] = ".") -> Scene:
        """The scene of a TOML text; files in it are relative to ``folder``."""
        return cls(_rodfit.Scene.from_toml(text, os.fspath(folder)), folder)

    @classmethod
    def from_dict(cls, table: Mapping[str, Any], folder: str | os.PathLike[str] = ".") -> Scene:
        """The scene of a table as the file has it."""
        return cls(table, folder)

    def to_toml(self) -> str:
        """The scene as a file."""
        return self._native.to_toml()

    def to_dict(self) -> dict[str, Any]:
        """The scene as a table, as the file has it."""
        if sys.version_info >= (3, 11):
            import tomllib
        else:
            import tomli as tomllib

        return tomllib.loads(self.to_toml())

    def replace(self, **tables: Mapping[str, Any] | None) -> Scene:
        """The scene with other entries: ``scene.replace(material={"youngs_modulus": 2e8})``. None removes an entry."""
        return Scene.from_dict(_merged(self.to_dict(), tables), self._folder)

    def with_values(self, values: Mapping[str, float]) -> Scene:
        """The scene with other values of its numbers, by the names of ``parameters``."""
        values = dict(values)
        return Scene(self._native.with_values(list(values), [float(v) for v in values.values()]), self._folder)

    @property
    def parameters(self) -> list[dict[str, Any]]:
        """All physical numbers: ``name``, ``aliases``, ``value``, ``unit``, ``limits``."""
        return list(read(self._native.parameters()))

    @property
    def warnings(self) -> list[str]:
        """What one should know before believing what is simulated."""
        return self._native.warnings()

    @property
    def model(self) -> str:
        """``planar`` or ``spatial``."""
        return self._native.model

    @property
    def resolution(self) -> dict[str, Any] | None:
        """Mesh, step and scheme that the program chose, and the error that they leave: ``resolution`` of the command's
        JSON; none where the scene gives them all."""
        text = self._native.resolution()
        return None if text is None else dict(read(text))

    @property
    def length(self) -> float:
        """Length of the rod, m."""
        return self._native.length

    def simulate(self, derivatives: str | Iterable[str] = ()) -> Run:
        """The motion of all nodes, with exact derivatives by these parameters. Numerics that the program chose are checked by
        the run, which is repeated with finer ones where needed. Other threads go on meanwhile; Ctrl-C ends it."""
        names = [derivatives] if isinstance(derivatives, str) else list(derivatives)
        return Run(self._native.simulate(names))

    def equilibrium(self) -> Equilibrium:
        """Where the rod rests under its loads."""
        return Equilibrium(read(self._native.equilibrium()))

    def modes(self, count: int = 6) -> Modes:
        """The lowest small vibrations about where it rests."""
        check_count(count)
        return Modes(read(self._native.modes(count)))

    def export(self, to: str) -> str:
        """The rod as the text of a file for another program.

        ``to`` is ``"mujoco"``, ``"pyelastica"``, ``"usd"`` or ``"csv"``, as in ``rodfit export``. Comments in the
        text say what it does not have, such as forces.
        """
        return self._native.export(to)[0]

    def __repr__(self) -> str:
        return f"Scene({self.model}, {self._native.nodes} nodes, {self.length:g} m)"

    def __reduce__(self) -> Any:
        return (Scene.from_toml, (self.to_toml(), self._folder))


def _merged(old: Mapping[str, Any], new: Mapping[str, Any]) -> dict[str, Any]:
    """A table with the entries of another one; None removes an entry."""
    both = dict(old)
    for key, value in new.items():
        inner = both.get(key)
        if is_table(value):
            both[key] = _merged(inner if is_table(inner) else {}, value)
        elif value is None:
            both.pop(key, None)
        else:
            both[key] = value
    return both
