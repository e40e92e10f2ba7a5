"""Scenes as functions for benchmark harnesses, which compare programs on the same scenario::

    from rodfit.benchmark import run
    positions = run("data/cantilever.toml", n_elements=40, n_frames=101)  # (101, 41, 3), m

The harness measures the time and compares the positions.
"""

from __future__ import annotations

import os
from numbers import Integral

from ._errors import refused
from ._scene import Scene

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Mapping
    from typing import Any

    import numpy as np
    from numpy.typing import NDArray

__all__ = ["run"]


def run(
    scenario: Scene | Mapping[str, Any] | str | os.PathLike[str],
    n_elements: int,
    n_frames: int,
    *,
    step: float | None = None,
    scheme: str | None = None,
) -> NDArray[np.float64]:
    """Simulates a scenario and returns the positions of all nodes, m: (n_frames, n_elements + 1, 3).

    ``scenario`` is a scene with ``[time]``: a ``Scene``, the name of its file, or its table. It is simulated on
    ``n_elements`` edges. The frames are equally spaced in time, from the start of the motion to its end; between steps
    positions are cubic in time. ``step``, s, and ``scheme`` replace those of the scene.
    """
    import numpy as np

    for name, number in {"n_elements": n_elements, "n_frames": n_frames}.items():
        if not isinstance(number, Integral) or number < 2:
            raise refused(name, number, "a whole number, 2 or more")
    scene = scenario if isinstance(scenario, Scene) else Scene(scenario)
    time = {key: value for key, value in {"step": step, "scheme": scheme}.items() if value is not None}
    if time and "time" not in scene.to_dict():
        raise refused("scenario", "a scene without [time]", "a scene with [time]")
    tables: dict[str, Mapping[str, Any]] = {"rod": {"segments": int(n_elements)}} | ({"time": time} if time else {})
    motion = scene.replace(**tables).simulate()
    times = np.linspace(0.0, motion.t[-1], n_frames)
    return np.stack([motion.at(node, times) for node in range(motion.position.shape[1])], axis=1)
