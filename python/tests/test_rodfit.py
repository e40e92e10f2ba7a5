"""The package against the shipped data, numpy, scipy, lmfit, pandas and JAX."""

import ast
import copy
import inspect
import json
import os
import pathlib
import pickle
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from numpy.typing import ArrayLike, NDArray

import rodfit

DATA = pathlib.Path(__file__).resolve().parents[2] / "data"


@pytest.fixture(scope="module")
def scene() -> rodfit.Scene:
    return rodfit.Scene.load(DATA / "cantilever.toml")


@pytest.fixture(scope="module")
def result() -> rodfit.FitResult:
    return rodfit.Fit.load(DATA / "cantilever-fit.toml").solve()


def tip() -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    rows = np.loadtxt(DATA / "cantilever-tip.csv", delimiter=",", skiprows=1)
    return rows[:, 0], rows[:, 1:]


@pytest.mark.parametrize("file", ["python/README.md", "docs/tutorials/python.md"])
def test_first_examples_of_documents_run(file: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """From the folder that they are read in."""
    monkeypatch.chdir(DATA.parent)
    code = (DATA.parent / file).read_text().split("```python\n")[1].split("```")[0]
    made: dict[str, Any] = {}
    exec(code, made)
    assert made["result"].success


def test_arrays_are_views_of_the_run(scene: rodfit.Scene) -> None:
    run = scene.simulate(derivatives=["youngs_modulus"])
    times, nodes = len(run), run.position.shape[1]
    assert run.position.shape == run.velocity.shape == (times, nodes, 3)
    # No copy: both look at the one block that the simulation wrote.
    assert run.position.base is not None
    position, velocity = (a.__array_interface__["data"][0] for a in (run.position, run.velocity))
    assert velocity - position == 3 * 8 and run.position.strides == (nodes * 48, 48, 8)
    with pytest.raises(ValueError):
        run.position[0, 0, 0] = 1.0
    # The derivative against a difference.
    modulus = scene.to_dict()["material"]["youngs_modulus"]
    step = 1e-5 * modulus
    beside = [scene.with_values({"youngs_modulus": modulus + s * step}).simulate().tip for s in (1, -1)]
    difference = (beside[0] - beside[1]) / (2 * step)
    exact = run.derivative["youngs_modulus"][:, -1, :]
    assert np.abs(exact - difference).max() < 1e-6 * np.abs(exact).max()


def test_position_of_a_point_at_any_time(scene: rodfit.Scene) -> None:
    run = scene.simulate()
    assert np.array_equal(run.at("tip"), run.tip) and np.array_equal(run.at(3, run.t[7]), run.position[7, 3])
    middle = {"arc_length": 0.4321 * scene.length}
    assert np.abs(run.at(middle) - run.at(middle, run.t)).max() == 0.0
    # Residuals of observations at 0 with a standard deviation of 1 m are the positions of the point.
    times = np.linspace(0.0, run.t[-1], 77)
    for point in ("tip", middle):
        fit = rodfit.Fit(scene).observe(times, np.zeros((77, 3)), at=point, sigma=1.0)
        r = fit.add("youngs_modulus", scene.to_dict()["material"]["youngs_modulus"]).residuals()
        assert np.abs(run.at(point, times).ravel() - r(r.x0)).max() < 1e-12
    wrong: dict[str, Any]
    for wrong in ({"t": -0.1}, {"t": [0.1, 99.0]}, {"point": "tips"}, {"point": {"arc_length": 9.0}}):
        with pytest.raises(rodfit.InputError):
            run.at(**wrong)


def test_energy_of_a_damped_run_decreases(scene: rodfit.Scene) -> None:
    run = scene.simulate()
    energy = run.energy
    assert set(energy) == {"kinetic", "stretch", "bend", "twist", "potential", "total"}
    assert all(term.shape == run.t.shape for term in energy.values()) and energy["bend"].max() > 0.0
    # The nodes' masses, half of each edge beside them.
    table = scene.to_dict()
    per_length = table["material"]["density"] * np.pi * table["rod"]["section"]["radius"] ** 2
    masses = per_length * np.gradient(run.arc_length) * np.r_[0.5, np.ones(len(run.arc_length) - 2), 0.5]
    kinetic = 0.5 * np.einsum("n,tnc->t", masses, run.velocity**2)
    assert energy["kinetic"] == pytest.approx(kinetic, rel=1e-9, abs=1e-12 * kinetic.max())
    # The rod loses what is damped, and gains nothing.
    assert energy["total"].max() - energy["total"][0] < 1e-6 * energy["kinetic"].max()


def test_run_converts_to_xarray(scene: rodfit.Scene) -> None:
    pytest.importorskip("xarray")
    run = scene.simulate(derivatives=["youngs_modulus"])
    data = run.to_xarray()
    assert data.position.dims == ("time", "node", "axis") and data.position.attrs["units"] == "m"
    assert np.array_equal(data.position.sel(axis="y").values[:, -1], run.tip[:, 1])
    assert np.shares_memory(data.position.values, run.position)
    assert float(data.arc_length[-1]) == pytest.approx(scene.length)
    assert np.array_equal(data.d_position_d_youngs_modulus, run.derivative["youngs_modulus"])
    assert np.array_equal(data.energy.sum("term"), run.energy["total"])


def test_chosen_numerics_are_reported(scene: rodfit.Scene, result: rodfit.FitResult, tmp_path: pathlib.Path) -> None:
    assert scene.resolution is None and scene.simulate().resolution is None and result.resolution == []
    text = (DATA / "cantilever.toml").read_text()
    given = ("segments =", "step =", "beta =")
    text = "".join(line for line in text.splitlines(keepends=True) if not line.startswith(given))
    chosen = rodfit.Scene.from_toml(text, DATA)
    run = chosen.simulate()
    # The run was checked, and its error is that of the check.
    assert run.resolution is not None and chosen.resolution is not None
    assert [run.resolution[key] for key in ("chosen", "accuracy")] == [chosen.resolution[key] for key in ("chosen", "accuracy")]
    assert run.warnings == []
    assert run.resolution["chosen"] == {"segments": True, "step": True, "scheme": True}
    assert run.resolution["segments"] == run.position.shape[1] - 1
    assert 0.0 < run.resolution["error"] < run.resolution["accuracy"]
    # As the command says it.
    (tmp_path / "open.toml").write_text(text)
    assert command("simulate", tmp_path / "open.toml", "--json", tmp_path / "run.json").returncode == 0
    assert json.loads((tmp_path / "run.json").read_text())["resolution"] == run.resolution
    fitted = rodfit.Fit(chosen).observe(*tip()).add("youngs_modulus").solve()
    assert [own and own["chosen"]["segments"] for own in fitted.resolution] == [True]


def test_scenes_convert_to_tables_and_back(scene: rodfit.Scene) -> None:
    table = scene.to_dict()
    again = rodfit.Scene.from_dict(table, DATA)
    assert np.array_equal(again.simulate().tip, scene.simulate().tip)
    twice = scene.replace(material={"youngs_modulus": 2 * table["material"]["youngs_modulus"]})
    assert not np.array_equal(twice.simulate().tip, scene.simulate().tip)
    assert np.array_equal(pickle.loads(pickle.dumps(scene)).simulate().tip, scene.simulate().tip)
    assert {"name", "unit", "value"} <= set(scene.parameters[0])
    for other in (rodfit.Scene(table, DATA), rodfit.Scene(DATA / "cantilever.toml"), rodfit.Scene.load(DATA / "cantilever.toml")):
        assert np.array_equal(other.simulate().tip, scene.simulate().tip)
    # A fit file is no scene, and a number neither.
    with pytest.raises(rodfit.InputError, match="rodfit.Scene or rodfit.Structure. Read a fit file with Fit.load"):
        rodfit.Fit("cantilever-fit.toml")  # type: ignore[arg-type]
    with pytest.raises(rodfit.InputError, match="point: found an argument, allowed: only at, sigma"):
        rodfit.Fit(scene).observe([0.0], [[0.5]], point="tip")
    with pytest.raises(rodfit.InputError, match="found 0.1 s after 0.2 s"):
        rodfit.Fit(scene).observe([0.2, 0.1], [[0.5], [0.5]]).add("youngs_modulus").solve()
    with pytest.raises(rodfit.InputError, match="Similar names: youngs_modulus"):
        rodfit.Fit(scene).add("E")
    with pytest.raises(rodfit.InputError, match="scene: found int, allowed: a table, or the name"):
        rodfit.Scene(3)  # type: ignore[arg-type]


def test_equilibrium_and_modes_equal_the_command(scene: rodfit.Scene) -> None:
    rest, modes = scene.equilibrium(), scene.modes(4)
    assert rest.nodes.shape[1] == 3 and rest.tip[1] < 0
    assert len(modes.frequencies_hz) >= 4 and modes.frequencies_hz[0] > 0
    assert rest.tip.shape == (3,) and rest.stable is True
    assert rest.warnings is not None and modes.resolution is None
    assert rest.mesh_error is None or rest.mesh_error["displacement"] > 0


def test_stability_of_a_planar_scene_without_shear_modulus() -> None:
    text = """
[rod]
segments = 20
shape = { kind = "straight", length = 0.3, direction = [1, 0, 0] }
section = { kind = "circle", radius = 0.003 }
[material]
density = 1100
youngs_modulus = 2e7
[loads]
gravity = [0, -9.81, 0]
"""
    rest = rodfit.Scene.from_toml(text).equilibrium()
    assert rest.stable is True and rest.stable_in_plane is True
    assert "stable=True" in repr(rest) and "in its plane only" in repr(rest)
    with pytest.raises(AttributeError, match="allowed: .*stable_in_plane"):
        rest.no_such_entry


def test_shipped_fit_recovers_known_modulus(result: rodfit.FitResult) -> None:
    modulus = result.params["youngs_modulus"]
    low, high = modulus.interval
    assert result.success and low < modulus.value < high and modulus.stderr > 0
    assert result.covar[0, 0] == pytest.approx(modulus.stderr**2)
    assert "youngs_modulus" in str(result) and "youngs_modulus" in result._repr_html_()
    again = pickle.loads(pickle.dumps(result))
    assert again.to_json() == result.to_json() and copy.copy(result).x == pytest.approx(result.x)


def test_arrays_and_file_give_equal_results(scene: rodfit.Scene, result: rodfit.FitResult) -> None:
    t, xyz = tip()
    fit = rodfit.Fit(scene).observe(t, xyz)
    for name in result.params:
        fit.add(name)
    assert fit.solve().x == pytest.approx(result.x, rel=1e-12)


def test_file_and_arrays_give_equal_results(scene: rodfit.Scene, result: rodfit.FitResult) -> None:
    fit = rodfit.Fit(scene).observe(DATA / "cantilever-tip.csv")
    for name in result.params:
        fit.add(name)
    assert fit.solve().x == pytest.approx(result.x, rel=1e-12)


def test_data_frames_are_accepted(scene: rodfit.Scene, result: rodfit.FitResult) -> None:
    pandas = pytest.importorskip("pandas")
    frame = result.to_dataframe()
    assert frame.loc["youngs_modulus", "value"] == result.params["youngs_modulus"].value

    t, xyz = tip()
    seen = pandas.DataFrame({"t": t, "y": xyz[:, 1], "x": xyz[:, 0], "note": "seen"})
    clocks = [seen, seen.set_index("t"), seen.drop(columns="t").set_index(pandas.to_timedelta(t, unit="s"))]
    arrays = rodfit.Fit(scene).observe(t, xyz[:, :2]).add("youngs_modulus", 1e8).residuals()
    for frame in clocks:
        r = rodfit.Fit(scene).observe(frame).add("youngs_modulus", 1e8).residuals()
        assert r(r.x0) == pytest.approx(arrays(r.x0), abs=1e-9)
    with pytest.raises(rodfit.InputError, match="columns t, x, y, z"):
        rodfit.Fit(scene).observe(seen[["t", "note"]])


def test_prior_and_input_uncertainty_enter_the_result(scene: rodfit.Scene, result: rodfit.FitResult) -> None:
    t, xyz = tip()
    value, error = result.params["youngs_modulus"].value, result.params["youngs_modulus"].stderr
    # A prior as sharp as the data, one standard error off, pulls halfway and narrows by the root of two.
    prior = (value + error, error)
    known = rodfit.Fit(scene).observe(t, xyz).add("youngs_modulus", prior=prior).solve()
    assert known.x[0] == pytest.approx(value + 0.5 * error, abs=0.05 * error)
    assert known.params["youngs_modulus"].stderr == pytest.approx(error / 2**0.5, rel=0.05)
    # A radius that is off goes into the budget, and a fixed one into the scene.
    radius = scene.to_dict()["rod"]["section"]["radius"]
    sure = rodfit.Fit(scene).observe(t, xyz).add("youngs_modulus").input_uncertainty("rod.section.radius", 1e-3 * radius)
    budget = sure.solve().params["youngs_modulus"].budget
    assert any("radius" in line["source"] for line in budget)
    thick = rodfit.Fit(scene).observe(t, xyz).add("youngs_modulus").add("radius", 1.01 * radius, vary=False)
    assert thick.solve().x[0] == pytest.approx(value * 1.01**-2, rel=1e-3)
    bounded = rodfit.Fit(scene).observe(t, xyz).add("youngs_modulus", max=2e8).residuals()
    assert bounded.bounds[1][0] == pytest.approx(2e8) and bounded.bounds[0][0] == 0.0


def test_former_names_warn(scene: rodfit.Scene, result: rodfit.FitResult) -> None:
    with pytest.warns(DeprecationWarning, match="basins is deprecated, use local_minima"):
        former = result.basins
    assert former == result.local_minima
    with pytest.warns(DeprecationWarning, match="words is deprecated, use summary"):
        assert result.local_minima["words"] == result.local_minima["summary"]
    with pytest.raises(AttributeError, match="no nonsense, allowed: "):
        result.nonsense
    with pytest.raises(KeyError):
        result.local_minima["nonsense"]
    with pytest.warns(DeprecationWarning, match="use Fit.input_uncertainty"):
        rodfit.Fit(scene).known("rod.section.radius", 1e-5)
    # A result of version 0.1.
    text = result.to_json().replace('"local_minima":', '"basins":').replace('"summary":', '"words":')
    assert rodfit.FitResult(text.replace('"found_by":', '"seen":')).to_json() == result.to_json()


def test_experiments_share_parameters(scene: rodfit.Scene, result: rodfit.FitResult) -> None:
    t, xyz = tip()
    stiff = scene.modes(1).frequencies_hz[0]
    fit = rodfit.Fit()
    fit.experiment("filmed", scene).observe(t, xyz)
    fit.experiment("struck", scene).frequencies([stiff], sigma=1e-3 * stiff)
    both = fit.add("youngs_modulus").solve()
    assert abs(both.x[0] - result.x[0]) < 4 * result.params["youngs_modulus"].stderr
    assert len(both.sigma) == 2


def test_result_has_text_and_html(result: rodfit.FitResult, tmp_path: pathlib.Path) -> None:
    assert result._repr_html_().startswith(f"<p><b>{result.grade}</b>: {result.verdict}")
    result.report(tmp_path / "fit.html")
    page = (tmp_path / "fit.html").read_text()
    assert page.startswith("<!doctype html>") and "<h2>Residuals" in page
    assert "plot_data" not in json.loads(result.to_json())
    assert rodfit.FitResult(result.to_json()).x == pytest.approx(result.x, rel=0)


def test_plot_has_data_and_residuals(scene: rodfit.Scene, result: rodfit.FitResult) -> None:
    matplotlib = pytest.importorskip("matplotlib")
    matplotlib.use("Agg")
    kept = rodfit.Fit.load(DATA / "cantilever-fit.toml").solve(plots=True)
    for drawn in (result, kept, pickle.loads(pickle.dumps(kept))):
        figure = drawn.plot()
        assert len(figure.axes) == 4 and np.size(figure.axes[0].lines[0].get_xdata()) == len(tip()[0])
    # A result that was read has no fit that could be done once more.
    with pytest.raises(rodfit.InputError, match="plots=True"):
        rodfit.FitResult(result.to_json()).plot()


def fit(scene: rodfit.Scene) -> rodfit.Fit:
    t, xyz = tip()
    modulus = scene.to_dict()["material"]["youngs_modulus"]
    return rodfit.Fit(scene).observe(t, xyz, sigma=1e-3).add("youngs_modulus", 1.1 * modulus)


def own(scene: rodfit.Scene) -> float:
    """To the tolerance of solvers that know of no noise."""
    return fit(scene).solve(tolerance=1e-7).params["youngs_modulus"].value


def test_scipy_finds_the_same_optimum(scene: rodfit.Scene) -> None:
    optimize = pytest.importorskip("scipy.optimize")
    for log in (False, True):
        r = fit(scene).residuals(log=log)
        options = {"jac": r.jac, "bounds": r.bounds, "x_scale": r.x_scale, "xtol": 1e-14, "ftol": 1e-14, "gtol": 1e-14}
        found = optimize.least_squares(r, r.x0, **options)
        assert r.values(found.x)["youngs_modulus"] == pytest.approx(own(scene), rel=1e-8)
        assert log or found.x[0] == pytest.approx(r.values(found.x)["youngs_modulus"], rel=1e-14)
    # A fit that ends where nobody sees a difference is as near as it says.
    early = fit(scene).solve().params["youngs_modulus"]
    assert abs(early.value - own(scene)) < 1e-3 * early.stderr


def test_lmfit_finds_the_same_optimum(scene: rodfit.Scene) -> None:
    lmfit = pytest.importorskip("lmfit")
    r = fit(scene).add("damping.mass", 0.1).residuals()
    params = r.to_lmfit()
    assert list(params) == ["youngs_modulus", "damping_mass"] and params["youngs_modulus"].min >= 0.0
    found = lmfit.minimize(r, params, Dfun=r.jac, xtol=1e-14, ftol=1e-14)
    both = fit(scene).add("damping.mass", 0.1).solve(tolerance=1e-7).params
    assert found.params["youngs_modulus"].value == pytest.approx(both["youngs_modulus"].value, rel=1e-7)
    # A parameter that does not vary keeps its value, and has no column.
    params["damping_mass"].set(value=1e-9, vary=False)
    assert r.jac(params).shape == (len(r), 1)
    found = lmfit.minimize(r, params, Dfun=r.jac, xtol=1e-14, ftol=1e-14)
    assert found.params["youngs_modulus"].value == pytest.approx(own(scene), rel=1e-6)


def test_residuals_scale_signed_parameters_by_their_effect(scene: rodfit.Scene) -> None:
    r = rodfit.Fit(scene).observe(*tip(), sigma=1e-3).add("camera.time_offset", 0.0).residuals()
    shift = r.x_scale[0]
    assert r.x0[0] == 0.0 and shift > 0.0
    assert np.sqrt(np.mean((r.jac(r.x0)[:, 0] * shift) ** 2)) == pytest.approx(1.0)
    assert "camera.time_offset" in repr(r)


def test_residuals_take_only_positive_values_of_positive_parameters(scene: rodfit.Scene) -> None:
    r = fit(scene).residuals()
    with pytest.raises(rodfit.InputError, match="youngs_modulus = -1, .*0 or more"):
        r([-1.0])


def test_residuals_have_their_derivatives_at_zero_damping(scene: rodfit.Scene) -> None:
    r = fit(scene).add("damping.mass", 0.1).residuals()
    x, h = np.array([1e8, 0.0]), 1e-4
    difference = (-3 * r(x) + 4 * r(x + [0, h]) - r(x + [0, 2 * h])) / (2 * h)
    column = r.jac(x)[:, 1]
    assert np.abs(column - difference).max() < 1e-6 * np.abs(column).max()
    with pytest.raises(rodfit.InputError, match="above 0"):
        r.hess(x)


def test_residuals_on_the_mesh_of_a_result_have_its_optimum(scene: rodfit.Scene) -> None:
    optimize = pytest.importorskip("scipy.optimize")
    table = scene.to_dict()
    del table["rod"]["segments"], table["time"]["step"]
    free = fit(rodfit.Scene.from_dict(table))
    result = free.solve(tolerance=1e-7)
    on_mesh, other = free.residuals(mesh_of=result), free.residuals()

    def value(r: rodfit.Residuals) -> float:
        found = optimize.least_squares(r, r.x0, jac=r.jac, x_scale=r.x_scale, xtol=1e-14, ftol=1e-14, gtol=1e-14)
        return r.values(found.x)["youngs_modulus"]

    # The result is corrected for the error of its mesh and step.
    corrected = value(on_mesh) * (1.0 + result.discretization_error[0]["correction"])
    assert result.params["youngs_modulus"].value == pytest.approx(corrected, rel=1e-6)
    assert value(other) != pytest.approx(value(on_mesh), rel=1e-9)
    with pytest.raises(rodfit.InputError, match="report"):
        two = rodfit.Fit().experiment("a", scene).experiment("b", scene).observe(*tip()).add("youngs_modulus", 1e8)
        two.residuals(mesh_of=result)


def test_design_has_the_errors_that_the_fit_then_has(scene: rodfit.Scene) -> None:
    plan = rodfit.Fit(scene).plan(duration=1.0, fps=100, sigma=1e-3, axes=["x", "y", "none"]).add("youngs_modulus")
    design = plan.design()
    expected = design.parameters[0]["std_error"]
    t = np.arange(0.01, 1.005, 0.01)
    place = scene.simulate().at("tip", t)
    measured = rodfit.Fit(scene).observe(t, place[:, :2], sigma=1e-3).add("youngs_modulus", 1e8).design()
    assert expected == pytest.approx(measured.parameters[0]["std_error"], rel=0.05)
    assert "youngs_modulus" in repr(design) and design.advice


def test_prediction_of_exact_data_has_no_error(scene: rodfit.Scene, tmp_path: pathlib.Path) -> None:
    t = np.linspace(0.1, 0.9, 9)
    prediction = rodfit.Fit(scene).observe(t, scene.simulate().at("tip", t), sigma=1e-3).predict(plots=True)
    assert len(prediction.errors) == 1 and prediction.errors[0]["rms"] < 1e-12
    prediction.report(tmp_path / "p.html")
    assert (tmp_path / "p.html").read_text().startswith("<!doctype html>")


def test_derivatives_between_steps_equal_differences(scene: rodfit.Scene) -> None:
    run = scene.simulate(derivatives=["youngs_modulus"])
    modulus, t = scene.to_dict()["material"]["youngs_modulus"], [0.1234, 0.5678]
    h = 1e-5 * modulus
    low, high = (scene.with_values({"youngs_modulus": modulus + d}).simulate().at("tip", t) for d in (-h, h))
    exact = run.at("tip", t, derivative="youngs_modulus")
    assert exact == pytest.approx((high - low) / (2 * h), abs=1e-6 * np.abs(exact).max())
    with pytest.raises(rodfit.InputError, match="derivative"):
        run.at("tip", t, derivative="density")


def test_stability_under_follower_loads_is_not_examined(scene: rodfit.Scene) -> None:
    load = {"point": [{"node": "tip", "force": [0.0, 0.001, 0.0], "follower": True}]}
    assert scene.equilibrium().stable and scene.replace(loads=load).equilibrium().stable is None


def test_messages_of_texts_name_no_file() -> None:
    with pytest.raises(rodfit.InputError) as error:
        rodfit.Scene.from_toml("[rod]\nsegmnts = 3\n")
    assert error.value.file is None and str(error.value).startswith("line 2")


def test_fit_names_its_parameters(scene: rodfit.Scene) -> None:
    assert repr(fit(scene)) == "Fit(youngs_modulus; 1 measurement)"


def test_sigma_of_each_time_scales_residuals(scene: rodfit.Scene) -> None:
    t, xyz = tip()
    plain = fit(scene).residuals()

    def one(sigma: ArrayLike) -> rodfit.Residuals:
        return rodfit.Fit(scene).observe(t, xyz, sigma=sigma).add("youngs_modulus", 1e8).residuals()

    x = plain.x0
    assert np.array_equal(one(np.full(len(t), 1e-3))(x), plain(x))
    own = 1e-3 * (1.0 + np.arange(len(t)) % 3)
    seen = len(plain(x)) // len(t)
    assert one(own)(x) == pytest.approx(plain(x) / np.repeat(own / 1e-3, seen), rel=1e-12)
    with pytest.raises(rodfit.InputError, match="sigma"):
        one(np.ones(3))
    with pytest.raises(rodfit.InputError, match="sigma"):
        rodfit.Fit(scene).observe(t, xyz, sigma="sx")


def test_derivatives_of_residuals_equal_differences(scene: rodfit.Scene) -> None:
    for log in (False, True):
        r = fit(scene).residuals(log=log)
        x = r.x0
        h = 1e-5 * r.x_scale
        jac, hess = r.jac(x), r.hess(x)
        assert len(r) == len(r(x)) == len(jac)
        difference = (r(x + h) - r(x - h)) / (2 * h)
        assert np.abs(jac[:, 0] - difference).max() < 1e-6 * np.abs(jac).max()
        slope = [float(r.jac(x + s)[:, 0] @ r(x + s)) for s in (h, -h)]
        assert hess[0, 0] == pytest.approx((slope[0] - slope[1]) / (2 * h[0]), rel=1e-6)


def test_jax_derivatives_are_exact(scene: rodfit.Scene) -> None:
    jax = pytest.importorskip("jax")
    jax.config.update("jax_enable_x64", True)
    import rodfit.jax

    r = fit(scene).add("damping.mass", 0.1).residuals(log=True)
    x = r.x0
    fun, misfit = rodfit.jax.residuals(r), rodfit.jax.misfit(r)
    for jacobian in (jax.jacfwd, jax.jacrev):
        assert np.allclose(jacobian(fun)(x), r.jac(x), rtol=1e-12, atol=0)
        assert np.allclose(jacobian(misfit)(x), r.jac(x).T @ r(x), rtol=1e-12, atol=0)
    assert np.allclose(jax.hessian(misfit)(x), r.hess(x), rtol=1e-10, atol=0)
    assert np.allclose(jax.jit(jax.grad(misfit))(x), r.jac(x).T @ r(x), rtol=1e-12, atol=0)
    # Newton's method on what JAX differentiates ends where rodfit does.
    r = fit(scene).residuals(log=True)
    misfit, x = rodfit.jax.misfit(r), r.x0
    for _ in range(12):
        x = x - np.linalg.solve(jax.hessian(misfit)(x), jax.grad(misfit)(x))
    assert r.values(x)["youngs_modulus"] == pytest.approx(own(scene), rel=1e-8)


def test_errors_have_file_key_and_line(scene: rodfit.Scene, tmp_path: pathlib.Path) -> None:
    with pytest.raises(rodfit.InputError) as error:
        scene.replace(rod={"segments": 0})
    assert error.value.key == "rod.segments" and error.value.found == "0" and error.value.allowed
    assert isinstance(error.value, rodfit.RodfitError) and isinstance(error.value, ValueError)
    again = pickle.loads(pickle.dumps(error.value))
    assert (str(again), again.key) == (str(error.value), "rod.segments")
    with pytest.raises(rodfit.InputError, match="Similar names: .*youngs_modulus"):
        scene.simulate(["youngs_moduls"])
    with pytest.raises(rodfit.InputError, match="Similar names: .*youngs_modulus"):
        rodfit.Fit(scene).add("youngs_moduls")
    with pytest.raises(rodfit.InputError, match="xyz"):
        rodfit.Fit(scene).observe([0.0, 1.0], [[0.0, 1.0]])
    with pytest.raises(rodfit.InputError, match="sigma"):
        rodfit.Fit(scene).frequencies([1.0], sigma=0.1, sigmas=0.1)
    bad = tmp_path / "bad.csv"
    bad.write_text("t,x\n0,0\n1,one\n")
    with pytest.raises(rodfit.InputError) as error:
        rodfit.Fit(scene).observe(bad)
    assert error.value.file == str(bad) and error.value.line == 3
    with pytest.raises(rodfit.ComputationError) as failure:
        scene.replace(time={"step": 0.5, "end": 5.0}).simulate()
    assert isinstance(failure.value, RuntimeError)


def test_other_threads_continue_during_a_fit(scene: rodfit.Scene) -> None:
    counted, done = [0], threading.Event()

    def count() -> None:
        while not done.is_set():
            counted[0] += 1
            time.sleep(1e-4)

    long = scene.replace(time={"end": 20.0})
    thread = threading.Thread(target=count)
    thread.start()
    before = counted[0]
    long.simulate()
    during = counted[0] - before
    done.set()
    thread.join()
    assert during > 10


def test_progress_is_called_on_the_calling_thread(scene: rodfit.Scene) -> None:
    calls, here = [], threading.get_ident()

    def record(stage: str, simulations: float) -> None:
        assert threading.get_ident() == here
        calls.append((stage, simulations))

    fit(scene).solve(progress=record)
    assert len(calls) > 2 and calls == sorted(calls, key=lambda t: t[1])

    def refuse(stage: str, simulations: float) -> None:
        raise ZeroDivisionError(stage)

    with pytest.raises(ZeroDivisionError):
        fit(scene).solve(progress=refuse)


def interrupted(code: str, seconds: float) -> tuple[float, str]:
    """The seconds that code takes to end by Ctrl-C, and what it says then."""
    # What a shell runs in the background ignores Ctrl-C, and so would all that it starts.
    heard = "import signal\nsignal.signal(signal.SIGINT, signal.default_int_handler)\n"
    words = [sys.executable, "-c", heard + code]
    process = subprocess.Popen(words, stdout=subprocess.PIPE, text=True)
    assert process.stdout is not None
    assert process.stdout.readline() == "begun\n"
    time.sleep(seconds)
    since = time.monotonic()
    process.send_signal(signal.SIGINT)
    said = process.stdout.readline()
    taken = time.monotonic() - since
    process.communicate(timeout=30)
    return taken, said


def test_ctrl_c_stops_a_simulation() -> None:
    code = (
        "import rodfit\n"
        f"s = rodfit.Scene.load({str(DATA / 'cantilever.toml')!r}).replace(time={{'end': 2000.0}})\n"
        "print('begun', flush=True)\n"
        "try:\n    s.simulate()\n"
        "except KeyboardInterrupt:\n    print('ended', flush=True)\n"
    )
    times, said = zip(*(interrupted(code, 0.2) for _ in range(3)))
    assert set(said) == {"ended\n"} and min(times) < 0.1


def test_ctrl_c_stops_a_fit_with_its_best_values() -> None:
    code = (
        "import rodfit\n"
        f"f = rodfit.Fit.load({str(DATA / 'cantilever-fit.toml')!r})\n"
        "seen = []\n"
        "def report(stage, work):\n"
        "    if stage.startswith('iteration') and not seen:\n"
        "        seen.append(stage)\n        print('begun', flush=True)\n"
        "r = f.solve(progress=report, plots=False, bootstrap=20000)\n"
        "print(r.interrupted, r.grade, r.params['youngs_modulus'].value, flush=True)\n"
    )
    times, said = zip(*(interrupted(code, 0.1) for _ in range(3)))
    assert all(0.9e8 < float(text.removeprefix("True interrupted ")) < 1.1e8 for text in said)
    assert min(times) < 0.1


def test_ctrl_c_within_a_progress_function_keeps_the_best_values() -> None:
    def report(stage: str, work: float) -> None:
        if stage.startswith("iteration"):
            raise KeyboardInterrupt

    # The replicates are still running when the exception arrives.
    fit = rodfit.Fit.load(DATA / "cantilever-fit.toml")
    result = fit.solve(progress=report, bootstrap=20000)
    assert result.interrupted and 0.9e8 < result.params["youngs_modulus"].value < 1.1e8


def command(*words: object) -> subprocess.CompletedProcess[str]:
    run = [sys.executable, "-m", "rodfit", *map(str, words)]
    return subprocess.run(run, capture_output=True, text=True, timeout=60)


def test_command_is_part_of_the_package(result: rodfit.FitResult, tmp_path: pathlib.Path) -> None:
    script = pathlib.Path(sys.executable).with_name("rodfit")
    assert not (pathlib.Path(rodfit.__file__).parent.parent.name == "site-packages" and not script.exists())
    version = command("--version")
    assert (version.returncode, version.stdout) == (0, f"rodfit {rodfit.__version__}\n")
    out = tmp_path / "fit.json"
    done = command("fit", DATA / "cantilever-fit.toml", "--json", out)
    assert done.returncode == 0 and "youngs_modulus" in done.stdout
    theirs, ours = json.loads(out.read_text()), json.loads(result.to_json())
    assert theirs["parameters"] == ours["parameters"] and theirs.keys() == ours.keys()
    # Bad input and bad words are 2, what cannot be computed 3.
    assert command("fit", tmp_path / "none.toml").returncode == 2
    assert command("fit").returncode == 2 and command("nonsense").returncode == 2
    scene = rodfit.Scene.load(DATA / "cantilever.toml").replace(time={"step": 0.5, "end": 5.0})
    (tmp_path / "bad.toml").write_text(scene.to_toml())
    failed = command("simulate", tmp_path / "bad.toml")
    assert failed.returncode == 3 and failed.stderr.startswith("error: ")


def test_stubs_equal_the_native_part() -> None:
    from rodfit import _rodfit

    folder = pathlib.Path(rodfit.__file__).parent
    assert (folder / "py.typed").exists()
    stub = ast.parse((folder / "_rodfit.pyi").read_text())

    def words(function: ast.FunctionDef) -> list[str]:
        return [a.arg for a in function.args.args if a.arg not in ("self", "cls")]

    def signature(function: Callable[..., object]) -> list[str]:
        return [name for name in inspect.signature(function).parameters if name != "self"]

    def members(thing: object) -> set[str]:
        return {name for name in vars(thing) if not name.startswith("_") or name in ("__len__", "__new__")}

    functions = {node.name: node for node in stub.body if isinstance(node, ast.FunctionDef)}
    classes = {node.name: node for node in stub.body if isinstance(node, ast.ClassDef)}
    assert members(_rodfit) == functions.keys() | classes.keys()
    for name, node in functions.items():
        assert words(node) == signature(getattr(_rodfit, name)), name
    for name, stubs in classes.items():
        own = {inner.name: inner for inner in stubs.body if isinstance(inner, ast.FunctionDef)}
        assert len(own) == len(stubs.body), name
        native = getattr(_rodfit, name)
        assert members(native) == own.keys(), name
        for method, inner in own.items():
            if method == "__new__":
                assert words(inner) == signature(native), name
            elif method != "__len__" and "property" not in {getattr(d, "id", "") for d in inner.decorator_list}:
                assert words(inner) == signature(getattr(native, method)), f"{name}.{method}"


OPEN = """
[rod]
shape = { kind = "straight", length = 0.5, direction = [1, 0, 0] }
section = { kind = "circle", radius = 0.005 }
[material]
density = 1000
youngs_modulus = 1e8
[loads]
gravity = [0, -9.8, 0]
[time]
end = 0.5
"""


def test_changed_scene_chooses_numerics_again() -> None:
    scene = rodfit.Scene.from_toml(OPEN)
    fresh = rodfit.Scene.from_toml(OPEN.replace("1e8", "2e6"))
    assert fresh.resolution is not None and scene.resolution is not None
    assert fresh.resolution["segments"] != scene.resolution["segments"]
    softer = {"youngs_modulus": 2e6}
    for other in (scene.with_values(softer), scene.replace(material=softer)):
        assert other.resolution == fresh.resolution
        assert np.array_equal(other.simulate().tip, fresh.simulate().tip)
    assert pickle.loads(pickle.dumps(scene)).resolution == scene.resolution
    assert not {"segments"} & scene.to_dict()["rod"].keys()
    assert scene.to_dict()["time"] == {"end": 0.5}


def test_node_beside_a_rotating_clamp_moves() -> None:
    table = rodfit.Scene.from_toml(OPEN).to_dict()
    table["rod"]["segments"], table["time"] = 10, {"end": 0.02, "step": 1e-3}
    table["supports"] = {"start_compliance": {"rotation": 1.0}}
    run = rodfit.Scene(table).simulate()
    assert run.arc_length == pytest.approx(run.position[0, :, 0], abs=1e-12)
    assert np.array_equal(run.at(3), run.position[:, 3])


def test_import_loads_no_slow_module() -> None:
    # What takes long is numpy, and after it json and typing with what they import.
    code = "import os, sys; had = set(sys.modules); import rodfit; print(*sorted(set(sys.modules) - had))"
    bare = subprocess.check_output([sys.executable, "-S", "-c", f"import sys; sys.path += {sys.path!r}; {code}"], text=True)
    assert [name for name in bare.split() if not name.startswith("rodfit")] == ["__future__"]


def test_structure_is_simulated_and_fitted() -> None:
    """A joint's compliance from the simulated tip of its arm, exact data."""
    crane = rodfit.Structure.load(DATA / "crane.toml")
    truth = crane.with_values({"joints.0.rotation": 4.0, "materials.rubber.youngs_modulus": 2e7})
    run = truth.simulate()
    # 400 steps; 20 edges and 21 nodes a rod.
    assert run.position["mast"].shape == run.position["arm"].shape == (401, 21, 3)
    tip = run.at({"rod": "arm", "at": "tip"})
    assert np.array_equal(run.at({"rod": "arm", "at": 20}), run.position["arm"][:, 20])
    assert run.at({"body": "bob"})[0] == pytest.approx([0.15, 0.15, 0.0])
    # The terms add up, and damping takes energy.
    total = np.sum([run.energy[term] for term in ("kinetic", "stretch", "bend", "twist", "potential")], axis=0)
    assert total == pytest.approx(run.energy["total"]) and total[-1] < total[0]
    fit = rodfit.Fit(crane).observe(run.t[1::4], tip[1::4, :2], at={"rod": "arm", "at": "tip"})
    result = fit.add("joints.0.rotation").add("materials.rubber.youngs_modulus").solve()
    assert result.params["joints.0.rotation"].value == pytest.approx(4.0, rel=1e-7)
    assert result.params["materials.rubber.youngs_modulus"].value == pytest.approx(2e7, rel=1e-7)
    assert {entry["name"] for entry in crane.parameters} >= {"bodies.bob.mass", "rods.arm.section.radius"}
    with pytest.raises(rodfit.InputError, match="mast, arm"):
        run.at({"rod": "amr", "at": "tip"})
