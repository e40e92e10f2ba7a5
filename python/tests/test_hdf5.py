"""Conversion of HDF5 files of DeepLabCut and SLEAP, which are written here as these programs write them."""

import pathlib

import numpy as np
import pytest

import rodfit

h5py = pytest.importorskip("h5py")
pandas = pytest.importorskip("pandas")


def test_file_of_deeplabcut_becomes_its_table(tmp_path: pathlib.Path) -> None:
    pytest.importorskip("tables")
    names = ["scorer", "bodyparts", "coords"]
    columns = pandas.MultiIndex.from_product([["net"], ["mid", "tip"], ["x", "y", "likelihood"]], names=names)
    frame = pandas.DataFrame(np.arange(24.0).reshape(4, 6), columns=columns)
    frame.iloc[2, 3] = np.nan
    source = tmp_path / "video.h5"
    frame.to_hdf(source, key="df_with_missing", format="table", mode="w")
    table = rodfit.hdf5_to_csv(source)
    lines = table.read_text().splitlines()
    assert table == tmp_path / "video.csv"
    assert lines[:3] == [
        "scorer,net,net,net,net,net,net",
        "bodyparts,mid,mid,mid,tip,tip,tip",
        "coords,x,y,likelihood,x,y,likelihood",
    ]
    assert lines[3] == "0,0.0,1.0,2.0,3.0,4.0,5.0"
    assert lines[5] == "2,12.0,13.0,14.0,,16.0,17.0"
    with pytest.raises(FileExistsError, match="a new file"):
        rodfit.hdf5_to_csv(source)


@pytest.mark.parametrize("tracks", [1, 2])
def test_analysis_of_sleap_becomes_its_table(tmp_path: pathlib.Path, tracks: int) -> None:
    # Tracks, x and y, nodes, frames.
    positions = np.arange(tracks * 2 * 2 * 3.0).reshape(tracks, 2, 2, 3)
    positions[0, :, 1, 2] = np.nan
    source, table = tmp_path / "video.h5", tmp_path / "tip.csv"
    with h5py.File(source, "w") as file:
        file["tracks"] = positions
        file["node_names"] = [b"mid", b"tip"]
        file["track_names"] = [b"rod", b"cable"][:tracks]
        file["point_scores"] = np.full((tracks, 2, 3), 0.5)
    assert rodfit.hdf5_to_csv(source, table) == table
    lines = table.read_text().splitlines()
    name = "rod" if tracks == 2 else ""
    assert lines[0] == "track,frame_idx,instance.score,mid.x,mid.y,mid.score,tip.x,tip.y,tip.score"
    assert lines[1] == f"{name},0,,0.0,6.0,0.5,3.0,9.0,0.5"
    assert lines[3] == f"{name},2,,2.0,8.0,0.5,,,"
    assert len(lines) == 1 + 3 * tracks


def test_other_hdf5_files_are_refused(tmp_path: pathlib.Path) -> None:
    source = tmp_path / "other.h5"
    with h5py.File(source, "w") as file:
        file["temperature"] = [1.0, 2.0]
    with pytest.raises(ValueError, match="of another kind"):
        rodfit.hdf5_to_csv(source)
    assert not source.with_suffix(".csv").exists()
    with h5py.File(source, "w") as file:
        file["tracks"] = np.zeros((3, 2))
        file["node_names"] = [b"tip"]
    with pytest.raises(ValueError, match="tracks of the shape"):
        rodfit.hdf5_to_csv(source)
    assert not source.with_suffix(".csv").exists()
