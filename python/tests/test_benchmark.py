"""The function for benchmark harnesses."""

import pathlib
from typing import Any

import numpy as np
import pytest

import rodfit
from rodfit.benchmark import run

DATA = pathlib.Path(__file__).resolve().parents[2] / "data"


def test_frames_are_those_of_the_simulation() -> None:
    scene = rodfit.Scene.load(DATA / "cantilever.toml")
    positions = run(scene, n_elements=20, n_frames=11)
    assert positions.shape == (11, 21, 3)
    # Frames at whole steps: every hundredth of a thousand.
    motion = scene.replace(rod={"segments": 20}).simulate()
    np.testing.assert_allclose(positions, motion.position[::100], rtol=0, atol=1e-12)


def test_scenarios_are_scenes_paths_and_tables() -> None:
    path = DATA / "published" / "pendulum.toml"
    scene = rodfit.Scene.load(path)
    frames = [run(scenario, 10, 5) for scenario in (path, str(path), scene, scene.to_dict())]
    for other in frames[1:]:
        assert np.array_equal(frames[0], other)


def test_period_of_the_pendulum_converges_to_its_closed_form() -> None:
    """A rod about a hinge at 90 degrees: 4 sqrt(2 L/(3 g)) K(sin 45 degrees), 1.1803406 times that of small swings."""
    exact = 1.1803405990160962 * 2 * np.pi * np.sqrt(2 / (3 * 9.81))

    def period(n_elements: int) -> float:
        n_frames = 2001
        x = run(DATA / "published" / "pendulum.toml", n_elements, n_frames, step=1e-3, scheme="newmark-beta")[:, -1, 0]
        after = np.flatnonzero((x[:-1] > 0) & (x[1:] <= 0)) + 1
        t = np.linspace(0, 2.5, n_frames)
        passages = t[after] + (t[1] - t[0]) * x[after] / (x[after - 1] - x[after])
        return float(passages[1] - passages[0])

    errors = [abs(period(n) / exact - 1) for n in (10, 20)]
    assert errors[1] < 1e-3 and errors[0] > 3 * errors[1]


@pytest.mark.parametrize("sizes, key", [((1, 5), "n_elements"), ((10, 1), "n_frames"), ((10.5, 5), "n_elements"), ((10, "5"), "n_frames")])
def test_invalid_sizes_are_rejected(sizes: tuple[Any, Any], key: str) -> None:
    with pytest.raises(rodfit.InputError, match=key):
        run(DATA / "cantilever.toml", *sizes)


def test_scene_without_a_motion_is_rejected() -> None:
    for step in (None, 1e-3):
        with pytest.raises(rodfit.InputError, match="time"):
            run(DATA / "published" / "elastica.toml", 10, 5, step=step)
