"""Conversion of HDF5 files of DeepLabCut and SLEAP to CSV tables, for the few kinds that rodfit does not read directly."""

from __future__ import annotations

TYPE_CHECKING = False
if TYPE_CHECKING:
    import os
    from pathlib import Path
    from typing import Any


def hdf5_to_csv(file: str | os.PathLike[str], csv_file: str | os.PathLike[str] | None = None) -> Path:
    """Writes the tracks of an HDF5 file of DeepLabCut or SLEAP (analysis) as the CSV table of the same program.

    ``csv_file`` is by default the file with the ending ``.csv``. An existing file is not replaced. Returns its path,
    which is the ``file`` of an observation. All need h5py, files of DeepLabCut also pandas and tables. Pandas
    reads the names of columns as Python objects (pickle): convert files of known origin only.

    Raises ``FileExistsError`` if the table exists, and ``ValueError`` for an HDF5 file of another kind.
    """
    # Imported here: `import rodfit` stays fast.
    import csv
    from pathlib import Path

    import h5py

    source = Path(file)
    target = Path(csv_file) if csv_file is not None else source.with_suffix(".csv")
    if target.exists():
        raise FileExistsError(f"found the file {target}, allowed: a new file")
    with h5py.File(source, "r") as content:
        if "tracks" in content and "node_names" in content:
            rows = _sleap(content, source)
            with target.open("x", newline="", encoding="utf-8") as table:
                csv.writer(table).writerows(rows)
            return target
        is_frame = any("pandas_type" in group.attrs for group in content.values())
    if not is_frame:
        raise ValueError(
            f"{source}: found an HDF5 file of another kind, allowed: DeepLabCut, or the analysis file of SLEAP"
        )
    import pandas

    frame = pandas.read_hdf(source)
    if not {"bodyparts", "coords"} <= set(frame.columns.names):
        raise ValueError(f"{source}: found columns {list(frame.columns.names)}, allowed: bodyparts and coords")
    with target.open("x", newline="", encoding="utf-8") as table:
        frame.to_csv(table)
    return target


def _sleap(content: Any, source: Path) -> list[list[object]]:
    """Rows of SLEAP's analysis table: one for each track and frame with a position."""
    import math

    tracks = content["tracks"]
    nodes = [name.decode() for name in content["node_names"][:]]
    names = [name.decode() for name in content["track_names"][:]] if "track_names" in content else []
    if tracks.ndim != 4 or tracks.shape[1:3] != (2, len(nodes)):
        raise ValueError(
            f"{source}: found tracks of the shape {tracks.shape}, allowed: (tracks, 2, {len(nodes)} nodes, frames)"
        )
    scores = content["point_scores"] if "point_scores" in content else None
    if scores is not None and scores.shape != (tracks.shape[0], *tracks.shape[2:]):
        raise ValueError(f"{source}: found point_scores of the shape {scores.shape}, allowed: as tracks")
    header = ["track", "frame_idx", "instance.score"]
    parts = ["x", "y"] if scores is None else ["x", "y", "score"]
    rows: list[list[object]] = [header + [f"{node}.{part}" for node in nodes for part in parts]]
    for track in range(tracks.shape[0]):
        name = names[track] if track < len(names) else f"track_{track}"
        positions = tracks[track].astype(float)
        confidence = None if scores is None else scores[track].astype(float)
        for frame in range(positions.shape[2]):
            row: list[object] = [name if tracks.shape[0] > 1 else "", frame, ""]
            for node in range(len(nodes)):
                x, y = (float(value) for value in positions[:, node, frame])
                found = math.isfinite(x) and math.isfinite(y)
                cells: list[object] = [x, y] if confidence is None else [x, y, float(confidence[node, frame])]
                row += cells if found else [""] * len(parts)
            if any(cell != "" for cell in row[3:]):
                rows.append(row)
    return rows
