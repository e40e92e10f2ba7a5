"""The package against the shipped data, numpy, scipy and lmfit."""

import copy
import pathlib
import pickle
import signal
import subprocess
import sys
import threading
import time

import numpy as np
import pytest

import rodfit

DATA = pathlib.Path(__file__).resolve().parents[2] / "data"


@pytest.fixture(scope="module")
def scene():
    return rodfit.Scene.load(DATA / "cantilever.toml")


@pytest.fixture(scope="module")
def result():
    return rodfit.Fit.load(DATA / "cantilever-fit.toml").solve()


def tip():
    rows = np.loadtxt(DATA / "cantilever-tip.csv", delimiter=",", skiprows=1)
    return rows[:, 0], rows[:, 1:]


def test_arrays_are_views_of_the_run(scene):
    run = scene.simulate(derivatives=["youngs_modulus"])
    times, nodes = len(run), run.position.shape[1]
    assert run.position.shape == run.velocity.shape == (times, nodes, 3)
    # No copy: both look at the one block that the simulation wrote.
    assert run.position.base is not None
    assert np.shares_memory(run.position, run.velocity.base if run.velocity.base is not None else run.velocity)
    with pytest.raises(ValueError):
        run.position[0, 0, 0] = 1.0
    # The derivative against a difference.
    modulus = scene.to_dict()["material"]["youngs_modulus"]
    step = 1e-5 * modulus
    beside = [scene.with_values({"youngs_modulus": modulus + s * step}).simulate().tip for s in (1, -1)]
    difference = (beside[0] - beside[1]) / (2 * step)
    exact = run.derivative["youngs_modulus"][:, -1, :]
    assert np.abs(exact - difference).max() < 1e-6 * np.abs(exact).max()


def test_scenes_go_to_tables_and_back(scene):
    table = scene.to_dict()
    again = rodfit.Scene.from_dict(table, DATA)
    assert np.array_equal(again.simulate().tip, scene.simulate().tip)
    twice = scene.replace(material={"youngs_modulus": 2 * table["material"]["youngs_modulus"]})
    assert not np.array_equal(twice.simulate().tip, scene.simulate().tip)
    assert np.array_equal(pickle.loads(pickle.dumps(scene)).simulate().tip, scene.simulate().tip)
    assert {"name", "unit", "value"} <= set(scene.parameters[0])


def test_rest_and_modes(scene):
    rest, modes = scene.equilibrium(), scene.modes(4)
    assert rest.nodes.shape[1] == 3 and rest.tip[1] < 0
    assert len(modes.frequencies_hz) >= 4 and modes.frequencies_hz[0] > 0


def test_the_shipped_fit(result):
    modulus = result.params["youngs_modulus"]
    low, high = modulus.interval
    assert result.success and low < modulus.value < high and modulus.stderr > 0
    assert result.covar[0, 0] == pytest.approx(modulus.stderr**2)
    assert "youngs_modulus" in str(result) and "youngs_modulus" in result._repr_html_()
    again = pickle.loads(pickle.dumps(result))
    assert again.to_json() == result.to_json() and copy.copy(result).x == pytest.approx(result.x)


def test_arrays_give_what_the_file_gives(scene, result):
    t, xyz = tip()
    fit = rodfit.Fit(scene).observe(t, xyz)
    for name in result.params:
        fit.add(name)
    assert fit.solve().x == pytest.approx(result.x, rel=1e-12)


def test_data_frames(result):
    pytest.importorskip("pandas")
    frame = result.to_dataframe()
    assert frame.loc["youngs_modulus", "value"] == result.params["youngs_modulus"].value


def residuals(scene):
    t, xyz = tip()
    modulus = scene.to_dict()["material"]["youngs_modulus"]
    return rodfit.Fit(scene).observe(t, xyz, sigma=1e-3).add("youngs_modulus", 1.1 * modulus).residuals()


def is_the_same(value, own):
    """A fit ends where another step would be below a thousandth of the standard error; other solvers go on."""
    assert abs(value - own.x[0]) < 1e-3 * own.params["youngs_modulus"].stderr


def test_scipy(scene):
    optimize = pytest.importorskip("scipy.optimize")
    r = residuals(scene)
    found = optimize.least_squares(r, r.x0, jac=r.jac, bounds=r.bounds, xtol=1e-14, ftol=1e-14, gtol=1e-14)
    t, xyz = tip()
    own = rodfit.Fit(scene).observe(t, xyz, sigma=1e-3).add("youngs_modulus").solve()
    is_the_same(r.values(found.x)["youngs_modulus"], own)
    # On the point: no slope is left.
    assert abs(found.grad[0]) < 1e-8 * np.abs(r.jac(found.x)).sum()


def test_lmfit(scene):
    lmfit = pytest.importorskip("lmfit")
    r = residuals(scene)
    start = lmfit.Parameters()
    start.add("x", value=r.x0[0])
    found = lmfit.minimize(lambda p: r([p["x"].value]), start, Dfun=lambda p: r.jac([p["x"].value]), xtol=1e-14, ftol=1e-14)
    t, xyz = tip()
    own = rodfit.Fit(scene).observe(t, xyz, sigma=1e-3).add("youngs_modulus").solve()
    is_the_same(r.values([found.params["x"].value])["youngs_modulus"], own)


def test_derivatives_of_residuals(scene):
    r = residuals(scene)
    x, h = r.x0, 1e-5
    jac, hess = r.jac(x), r.hess(x)
    difference = (r(x + h) - r(x - h)) / (2 * h)
    assert np.abs(jac[:, 0] - difference).max() < 1e-6 * np.abs(jac).max()
    slope = [float(r.jac(x + s)[:, 0] @ r(x + s)) for s in (h, -h)]
    assert hess[0, 0] == pytest.approx((slope[0] - slope[1]) / (2 * h), rel=1e-6)


def test_errors_say_where(tmp_path):
    with pytest.raises(rodfit.InputError) as error:
        rodfit.Scene.load(DATA / "cantilever.toml").replace(rod={"segments": 0})
    assert error.value.key == "rod.segments" and error.value.found == "0" and error.value.allowed
    assert isinstance(error.value, rodfit.RodfitError)
    with pytest.raises(rodfit.InputError, match="youngs"):
        rodfit.Scene.load(DATA / "cantilever.toml").simulate(["youngs_moduls"])
    with pytest.raises(rodfit.InputError, match="xyz"):
        rodfit.Fit(rodfit.Scene.load(DATA / "cantilever.toml")).observe([0.0, 1.0], [[0.0, 1.0]])


def test_other_threads_go_on(scene):
    counted, done = [0], threading.Event()

    def count():
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


def test_ctrl_c_ends_a_simulation(tmp_path):
    code = (
        "import rodfit, sys\n"
        f"s = rodfit.Scene.load({str(DATA / 'cantilever.toml')!r}).replace(time={{'end': 2000.0}})\n"
        "print('begun', flush=True)\n"
        "try:\n    s.simulate()\n"
        "except KeyboardInterrupt:\n    print('ended', flush=True)\n"
    )
    process = subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE, text=True)
    assert process.stdout.readline() == "begun\n"
    time.sleep(0.3)
    process.send_signal(signal.SIGINT)
    assert process.communicate(timeout=30)[0] == "ended\n"


def test_importing_it_imports_no_numpy():
    code = "import sys, rodfit; sys.exit('numpy' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code]).returncode == 0
