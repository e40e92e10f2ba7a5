"""Structures of several rods, bodies and joints, and their motion."""

from __future__ import annotations

import os

from . import _rodfit
from ._errors import check_count, check_path, refused
from ._scene import ENERGIES
from ._tables import is_table, read, written

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Mapping
    from typing import Any

    import numpy as np
    from numpy.typing import NDArray


class StructureRun:
    """A simulated motion of a structure: ``t``, s."""

    def __init__(self, native: _rodfit.StructureRun):
        self._native = native
        self.t: NDArray[np.float64] = native.t
        self._motion = native.motion
        for array in (self.t, self._motion):
            array.flags.writeable = False

    @property
    def position(self) -> dict[str, NDArray[np.float64]]:
        """Positions of the nodes of every rod by its name, m: (times, nodes, 3)."""
        positions, first = {}, 0
        for name, count in self._native.rods():
            positions[name] = self._motion[:, first : first + count, 0, :]
            first += count
        return positions

    def at(self, point: Mapping[str, Any]) -> NDArray[np.float64]:
        """Positions of a point at all times, m: (times, 3). ``point`` is {"rod": name, "at": "tip"} or {"body": name}, with
        the other keys of an observed point."""
        import numpy as np

        nodes, weights = self._native.stencil(written(point, "at"))
        return np.asarray(sum(weight * self._motion[:, node, 0, :] for node, weight in zip(nodes, weights)))

    @property
    def energy(self) -> dict[str, NDArray[np.float64]]:
        """Energies by term and their sum ``total``, J: (times,)."""
        terms = dict(zip(ENERGIES, self._native.energies.T))
        return {**terms, "total": self._native.energies.sum(axis=1)}

    def __len__(self) -> int:
        return len(self.t)

    def __repr__(self) -> str:
        return f"StructureRun({len(self)} times to {self.t[-1]:g} s, {len(self._native.rods())} rods)"


class Structure:
    """A structure, read and validated; it cannot be changed, ``with_values`` makes others."""

    def __init__(self, structure: Mapping[str, Any] | str | os.PathLike[str] | _rodfit.Structure, folder: str | os.PathLike[str] = "."):
        """The structure of a table as the file has it, or of a TOML file. Files that a table names are relative to ``folder``."""
        if is_table(structure):
            structure = _rodfit.Structure.from_json(written(structure), os.fspath(folder))
        elif isinstance(structure, (str, os.PathLike)):
            check_path("structure", structure, "Structure.from_toml")
            folder = os.path.dirname(os.path.abspath(structure))
            structure = _rodfit.Structure.load(os.fspath(structure))
        elif not isinstance(structure, _rodfit.Structure):
            raise refused("structure", type(structure).__name__, "a table, or the name of a TOML file")
        self._structure = structure
        # The scene of the structure in fits.
        self._native = structure.scene()
        self._folder = os.fspath(folder)

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> Structure:
        """The structure of a TOML file."""
        return cls(path)

    @classmethod
    def from_toml(cls, text: str, folder: str | os.PathLike[str] = ".") -> Structure:
        """The structure of a TOML text; files in it are relative to ``folder``."""
        return cls(_rodfit.Structure.from_toml(text, os.fspath(folder)), folder)

    def to_toml(self) -> str:
        """The structure as a file."""
        return self._structure.to_toml()

    def with_values(self, values: Mapping[str, float]) -> Structure:
        """The structure with other values of its numbers, by the names of ``parameters``."""
        values = dict(values)
        scene = self._native.with_values(list(values), [float(v) for v in values.values()])
        return Structure.from_toml(scene.to_toml(), self._folder)

    @property
    def parameters(self) -> list[dict[str, Any]]:
        """All physical numbers: ``name``, ``aliases``, ``value``, ``unit``, ``limits``."""
        return list(read(self._native.parameters()))

    def simulate(self) -> StructureRun:
        """The motion of all rods and bodies. Other threads continue; Ctrl-C stops the run."""
        return StructureRun(self._structure.simulate())

    def equilibrium(self) -> dict[str, Any]:
        """The equilibrium: the JSON of ``rodfit static``."""
        return dict(read(self._structure.equilibrium()))

    def modes(self, count: int = 6) -> dict[str, Any]:
        """The lowest modes in the plane: the JSON of ``rodfit modes``."""
        check_count(count)
        return dict(read(self._structure.modes(count)))

    def __repr__(self) -> str:
        return f"Structure({self._native.nodes} nodes)"

    def __reduce__(self) -> Any:
        return (Structure.from_toml, (self.to_toml(), self._folder))
