"""Exported rods in other programs: the same equilibrium as here."""

import numpy as np
import pytest
from numpy.typing import NDArray

import rodfit

mujoco = pytest.importorskip("mujoco")

CANTILEVER = """
[rod]
segments = 30
shape = { kind = "straight", length = 0.5, direction = [1, 0, 0] }
section = { kind = "circle", radius = 0.005 }
[material]
density = 1200
youngs_modulus = 1e8
poisson_ratio = 0.5
[loads]
gravity = [0, 0, -9.81]
"""
STRAIGHT = 'shape = { kind = "straight", length = 0.5, direction = [1, 0, 0] }'
HELIX = CANTILEVER.replace(
    STRAIGHT,
    'shape = { kind = "helix", length = 0.5, radius = 0.02, pitch = 0.05, axis = [0, 0, -1], handedness = "right" }',
).replace("segments = 30", "segments = 60")
# Its stress-free shape is another one than its rest shape, and twisted.
ARC = CANTILEVER.replace(
    STRAIGHT,
    'shape = { kind = "arc", length = 0.5, angle = 0.785398 }\n'
    "natural_curvature = 1.5\nnatural_twist = 2.0",
)


def tip_at_rest(text: str) -> NDArray[np.float64]:
    """The tip of a model of MuJoCo at rest, m, by Newton's method with the weight in ten steps."""
    model = mujoco.MjModel.from_xml_string(text)
    data = mujoco.MjData(model)
    site = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_SITE, "tip")
    gravity = model.opt.gravity.copy()

    def residual(q: NDArray[np.float64]) -> NDArray[np.float64]:
        data.qpos[:], data.qvel[:] = q, 0
        mujoco.mj_forward(model, data)
        return np.asarray(data.qfrc_passive - data.qfrc_bias)

    q, h = np.zeros(model.nq), 1e-6
    for part in np.linspace(0.1, 1, 10):
        model.opt.gravity[:] = part * gravity
        for _ in range(8):
            columns = [(residual(q + h * e) - residual(q - h * e)) / (2 * h) for e in np.eye(model.nv)]
            change = np.linalg.solve(np.array(columns).T, -residual(q))
            q = q + change
            if abs(change).max() < 1e-9:
                break
    residual(q)
    return np.array(data.site_xpos[site])


# Two meshes of second order differ: the bounds are about three times the differences found.
@pytest.mark.parametrize("text, bound", [(CANTILEVER, 1e-4), (HELIX, 2e-5), (ARC, 4e-4)])
def test_mujoco_has_the_same_equilibrium(text: str, bound: float) -> None:
    scene = rodfit.Scene.from_toml(text)
    tip = np.array(scene.equilibrium().tip)
    assert np.linalg.norm(tip_at_rest(scene.export("mujoco")) - tip) < bound


def test_unknown_format_lists_the_formats() -> None:
    with pytest.raises(ValueError, match="mujoco, pyelastica, usd or csv"):
        rodfit.Scene.from_toml(CANTILEVER).export("abaqus")
