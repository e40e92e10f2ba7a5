"""Inputs as users have them: arrays of any kind, wrong values and their messages, static tests as measurements."""

import copy
import math
import pathlib
import pickle
from typing import Any

import numpy as np
import pytest
from numpy.typing import ArrayLike

import rodfit

DATA = pathlib.Path(__file__).resolve().parents[2] / "data"
BENCH = """
[rod]
segments = 40
shape = { kind = "straight", length = 0.3, direction = [1, 0, 0] }
section = { kind = "circle", radius = 0.002 }
[material]
density = 1100
youngs_modulus = 2e8
[loads]
gravity = [0, 0, 0]
[[loads.point]]
node = "tip"
force = [0, 0, 0]
"""
MODULUS, LOAD = 2e8, "loads.point.0.force"
# Euler's critical load of the clamped column, N.
CRITICAL = math.pi**2 * MODULUS * math.pi * 0.002**4 / 4 / (4 * 0.3**2)


@pytest.fixture(scope="module")
def scene() -> rodfit.Scene:
    return rodfit.Scene.load(DATA / "cantilever.toml")


@pytest.fixture
def bench(tmp_path: pathlib.Path, monkeypatch: pytest.MonkeyPatch) -> rodfit.Scene:
    """A rod under a force at its tip, in a folder with a table of its deflections."""
    scene = rodfit.Scene.from_toml(BENCH)
    rows = [(f, scene.with_values({f"{LOAD}.y": -f}).equilibrium().tip[1]) for f in (0.01, 0.02, 0.04, 0.06)]
    (tmp_path / "bending.csv").write_text("load[N],y[m]\n" + "".join(f"{f},{y}\n" for f, y in rows))
    (tmp_path / "bench.toml").write_text(BENCH)
    monkeypatch.chdir(tmp_path)
    return scene


def clip() -> np.ndarray:
    """Times and positions of the tip: (n, 3)."""
    return np.loadtxt(DATA / "cantilever-tip.csv", delimiter=",", skiprows=1)


def residuals(scene: rodfit.Scene, t: ArrayLike, xyz: ArrayLike, **keys: Any) -> rodfit.Residuals:
    return rodfit.Fit(scene).observe(t, xyz, **keys).add("youngs_modulus", 1e8).residuals()


def refusal(call: Any) -> rodfit.InputError:
    """The error of a call."""
    with pytest.raises(rodfit.InputError) as error:
        call()
    return error.value


def test_arrays_of_any_layout_have_equal_residuals(scene: rodfit.Scene) -> None:
    t, xyz = clip()[:, 0], clip()[:, 1:]
    fixed = xyz.copy()
    fixed.flags.writeable = False
    plain = residuals(scene, t, xyz)([1e8])
    layouts = [fixed, np.asfortranarray(xyz), np.repeat(xyz, 2, axis=1)[:, ::2], xyz.astype(">f8"), xyz.astype(object), xyz.tolist()]
    for layout in layouts:
        assert np.array_equal(residuals(scene, t, layout)([1e8]), plain)
    whole = residuals(scene, np.array([1]), np.array([[0, 0, 0]]), sigma=1)([1e8])
    assert np.array_equal(whole, residuals(scene, [1.0], [[0.0, 0.0, 0.0]], sigma=1.0)([1e8]))


def test_masked_and_missing_positions_are_left_out(scene: rodfit.Scene) -> None:
    t, xyz = clip()[:, 0], clip()[:, 1:]
    hidden = xyz < -0.1
    expected = residuals(scene, t, np.where(hidden, np.nan, xyz))([1e8])
    assert len(expected) == xyz.size - hidden.sum() < xyz.size
    masked = np.ma.masked_where(hidden, xyz)
    assert np.array_equal(residuals(scene, t, masked)([1e8]), expected) and np.array_equal(masked.data, xyz)
    pandas = pytest.importorskip("pandas")
    frame = pandas.DataFrame({"t": t, "x": xyz[:, 0], "y": xyz[:, 1]}).convert_dtypes()
    frame["y"] = frame["y"].mask(frame["y"] < -0.1)
    assert np.array_equal(rodfit.Fit(scene).observe(frame).add("youngs_modulus", 1e8).residuals()([1e8]), expected)


def test_arrays_that_are_no_real_numbers_are_refused(scene: rodfit.Scene) -> None:
    t, xyz = clip()[:, 0], clip()[:, 1:]
    fit = rodfit.Fit(scene)
    wrong: list[Any] = [xyz + 1j, [["a", "b"]] * len(t), [[1.0]] * (len(t) - 1) + [[1.0, 2.0]]]
    for values in wrong:
        assert refusal(lambda: fit.observe(t, values)).key == "xyz"
    assert refusal(lambda: fit.observe(t, xyz, sigma=np.full(xyz.shape, 1e-3))).found == f"an array of shape {xyz.shape}"
    dates = np.datetime64("2026-01-01") + (t * 1e9).astype("timedelta64[ns]")
    assert refusal(lambda: fit.observe(dates, xyz)).found == "dates"
    seconds = residuals(scene, dates - dates[0], xyz)([1e8])
    assert seconds == pytest.approx(residuals(scene, t, xyz)([1e8]), abs=1e-6)


def test_numbers_that_are_not_finite_are_named(scene: rodfit.Scene) -> None:
    material = {"youngs_modulus": math.nan}
    assert refusal(lambda: scene.replace(material=material)).key == "material.youngs_modulus"
    gravity = {"gravity": np.array([0.0, -math.inf, 0.0])}
    assert refusal(lambda: scene.replace(loads=gravity)).key == "loads.gravity[1]"
    fit = rodfit.Fit(scene)
    assert refusal(lambda: fit.frequencies([1.0, math.nan], sigma=0.1)).key == "frequencies.hz[1]"
    assert refusal(lambda: fit.observe([0.0], [[0.5]], at={"arc_length": math.nan})).key == "at.arc_length"
    assert refusal(lambda: fit.solve(tolerance=math.nan)).key == "analysis.tolerance"
    assert refusal(lambda: fit.add("youngs_modulus", math.inf)).key == "parameter.start"
    table = scene.to_dict()
    table["material"]["density"] = None
    assert refusal(lambda: rodfit.Scene(table)).key == "material.density"


def test_key_behind_a_text_of_several_lines_is_named(scene: rodfit.Scene) -> None:
    table = scene.to_dict()
    table["supports"] = {"path": {"file": "a\n[b]\nc = 1\n", "fps": "25"}}
    error = refusal(lambda: rodfit.Scene(table))
    assert error.key == "supports.path.fps" and "expected a number" in str(error)


def test_arguments_of_parameters_are_checked(scene: rodfit.Scene) -> None:
    fit = rodfit.Fit(scene)
    wrong: list[tuple[str, Any]] = [("value", "1e8"), ("value", True), ("min", [1.0]), ("prior", 3.0), ("prior", (1e8,))]
    for key, value in wrong:
        assert refusal(lambda: fit.add("youngs_modulus", **{key: value})).key == key
    # An infinite bound is none.
    fit.observe(clip()[:, 0], clip()[:, 1:]).add("youngs_modulus", np.float64(1e8), min=-math.inf, max=math.inf)
    assert [float(side[0]) for side in fit.residuals().bounds] == [0.0, math.inf]
    assert [float(side[0]) for side in fit.residuals(log=True).bounds] == [-math.inf, math.inf]


def test_measurements_before_an_experiment_are_refused() -> None:
    for call in (
        lambda: rodfit.Fit().observe([0.0], [[0.5]]),
        lambda: rodfit.Fit().frequencies([1.0], sigma=0.1),
        lambda: rodfit.Fit().predict(),
    ):
        assert refusal(call).key == "experiment"


def test_texts_and_other_objects_are_no_files(scene: rodfit.Scene) -> None:
    calls: list[Any] = [lambda: rodfit.Scene(BENCH), lambda: rodfit.Structure(BENCH), lambda: rodfit.Fit.load(BENCH)]
    for call in calls:
        assert "from_toml reads a text" in str(refusal(call))
    wrong: Any = 3
    assert refusal(lambda: rodfit.Fit(scene).residuals(mesh_of=wrong)).key == "mesh_of"
    assert refusal(lambda: rodfit.Fit(scene).solve(progress=wrong)).key == "progress"
    assert refusal(lambda: scene.modes(-1)).key == "count"


def test_residuals_take_one_number_for_each_parameter(scene: rodfit.Scene) -> None:
    r = residuals(scene, clip()[:, 0], clip()[:, 1:])
    wrong: list[Any] = [[], [1e8, 1e8], [[1e8]], [math.inf]]
    for x in wrong:
        for function in (r, r.jac, r.hess, r.values):
            assert refusal(lambda: function(x)).key == "x"
    assert refusal(lambda: r.scaled({"youngs_modulus": -1.0})).key == "values"
    assert r.scaled({"youngs_modulus": 1e8})[0] == 1e8


def test_parameters_of_experiments_have_names_in_lmfit(scene: rodfit.Scene) -> None:
    pytest.importorskip("lmfit")
    fit = rodfit.Fit()
    for name in ("a", "b"):
        fit.experiment(name, scene).frequencies([1.0], sigma=0.1).add("youngs_modulus", 1e8, experiment=name)
    r = fit.residuals()
    assert list(r.to_lmfit()) == ["youngs_modulus_a", "youngs_modulus_b"]
    assert np.array_equal(r(r.to_lmfit()), r(r.x0))


def test_options_of_an_analysis_hold_for_one_solution(scene: rodfit.Scene) -> None:
    fit = rodfit.Fit(scene).observe(clip()[:, 0], clip()[:, 1:]).add("youngs_modulus")
    before = fit.solve()
    fit.solve(bootstrap=20)
    assert fit.solve().to_json().count("bootstrap") == before.to_json().count("bootstrap")
    assert fit.solve().simulations == before.simulations


def test_copies_of_fits_are_independent(scene: rodfit.Scene) -> None:
    fit = rodfit.Fit(scene).frequencies([1.0], sigma=0.1)
    for other in (copy.copy(fit), copy.deepcopy(fit)):
        other.add("youngs_modulus")
        assert "youngs_modulus" in repr(other) and repr(fit) == "Fit(no parameters; 1 measurement)"


def test_none_removes_an_entry_of_a_scene(scene: rodfit.Scene) -> None:
    free = scene.replace(rod={"segments": None}, time={"step": None})
    assert free.resolution is not None and "segments" not in free.to_dict()["rod"]
    # Also an entry of a table that the scene lacks.
    assert free.replace(camera=None, initial={"state": None}).to_dict() == free.to_dict()


def test_structures_can_be_pickled_and_results_list_their_entries(bench: rodfit.Scene) -> None:
    crane = rodfit.Structure.load(DATA / "crane.toml")
    assert pickle.loads(pickle.dumps(crane)).to_toml() == crane.to_toml()
    result = rodfit.Fit(bench).frequencies([1.36], sigma=0.01).add("youngs_modulus").solve()
    assert {"grade", "warnings", "x"} <= set(dir(result)) and "interval95" in dir(result.params["youngs_modulus"])


def test_load_deflection_table_determines_the_modulus(bench: rodfit.Scene) -> None:
    keys = {"sigma": 1e-4, "load_factor": -1.0}
    table = f'scene = "bench.toml"\n[[load_deflection]]\nload = "{LOAD}.y"\nfile = "bending.csv"\nload_factor = -1.0\nsigma = 1e-4\n'
    fits = [
        rodfit.Fit(bench).load_deflection(f"{LOAD}.y", "bending.csv", **keys).add("youngs_modulus"),
        rodfit.Fit.from_toml(table + '[[parameter]]\nname = "youngs_modulus"'),
    ]
    for fit in fits:
        assert fit.solve().params["youngs_modulus"].value == pytest.approx(MODULUS, rel=1e-6)
    r = rodfit.Fit(bench).load_deflection(f"{LOAD}.y", "bending.csv", **keys).add("youngs_modulus", 1.1 * MODULUS).residuals()
    h = 1e-5 * r.x0
    assert r.jac(r.x0)[:, 0] == pytest.approx((r(r.x0 + h) - r(r.x0 - h)) / (2 * h), rel=1e-6)
    prediction = rodfit.Fit(bench).load_deflection(f"{LOAD}.y", "bending.csv", **keys).predict()
    assert prediction.errors[0]["rms"] < 1e-12 and "bending.csv" in repr(prediction) and "./" not in repr(prediction)


def test_wrong_load_deflection_tables_are_refused(bench: rodfit.Scene) -> None:
    def table(load: str = f"{LOAD}.y", file: str = "bending.csv", **keys: Any) -> rodfit.Fit:
        return rodfit.Fit(bench).load_deflection(load, file, **keys).add("youngs_modulus")

    assert refusal(lambda: table(file="none.csv")).file == "none.csv"
    assert refusal(lambda: table("youngs_modulus").solve()).key == "load_deflection[0].load"
    assert "sigmas" in str(refusal(lambda: table(sigmas=1e-4)))


def test_critical_load_determines_the_modulus(bench: rodfit.Scene) -> None:
    fit = rodfit.Fit(bench).buckling(f"{LOAD}.x", -CRITICAL, sigma=1e-3 * CRITICAL).add("youngs_modulus")
    result = fit.solve()
    # The mesh has 40 segments.
    assert result.params["youngs_modulus"].value == pytest.approx(MODULUS, rel=2e-4)
    assert result.params["youngs_modulus"].stderr == pytest.approx(1e-3 * MODULUS, rel=1e-2)
    assert refusal(lambda: rodfit.Fit(bench).buckling(f"{LOAD}.x", math.nan, sigma=1.0)).key == "buckling.value"
    zero = rodfit.Fit(bench).buckling(f"{LOAD}.x", 0.0, sigma=1.0).add("youngs_modulus")
    assert refusal(zero.solve).key == "buckling[0].value"
    # A force across the rod bends it from the first load on.
    across = rodfit.Fit(bench).buckling(f"{LOAD}.y", CRITICAL, sigma=1e-3).add("youngs_modulus")
    with pytest.raises(rodfit.ComputationError, match="a straight rod buckles"):
        across.solve()


def test_errors_of_tables_have_the_key_and_no_line(scene: rodfit.Scene) -> None:
    fit, loads = rodfit.Fit(scene), [{"node": "tip", "force": [0, 0, 0]}, {"node": "tip", "forc": [0, 0, 0]}]
    calls: list[tuple[str, Any]] = [
        ("material.youngs_modulus", lambda: scene.replace(material={"youngs_modulus": "1e8"})),
        ("material", lambda: rodfit.Scene(scene.to_dict() | {"material": 3})),
        ("loads.point.forc", lambda: scene.replace(loads={"point": loads})),
        ("frequencies.sigmas", lambda: fit.frequencies([1.0], sigma=0.1, sigmas=0.1)),
        ("analysis.bootstrap", lambda: fit.solve(bootstrap="many")),
        ("loss", lambda: fit.observe([0.0], [[0.5]], loss="cachy")),
        ("at", lambda: fit.observe([0.0], [[0.5]], at="tips")),
        ("rods", lambda: rodfit.Structure({"rods": 3})),
    ]
    for key, call in calls:
        error = refusal(call)
        assert error.key == key and str(error).startswith(f"{key}: ") and "line" not in str(error)
