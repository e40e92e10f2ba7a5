"""Campaigns on Dask workers, for machines without a job scheduler or with one that dask-jobqueue supports::

    import rodfit.campaign
    from dask.distributed import Client, LocalCluster, wait

    if __name__ == "__main__":
        with Client(LocalCluster(threads_per_worker=1)) as client:
            wait(rodfit.campaign.submit(client, "out"))

Plan it with ``rodfit campaign plan campaign.toml --out out``, and collect with ``rodfit campaign collect out``: results are the same
bytes as those of ``rodfit campaign run``. They are stored at once in the same folder, which all workers must share.
"""

from __future__ import annotations

import functools
import os
import pathlib

from . import _rodfit

TYPE_CHECKING = False
if TYPE_CHECKING:
    from distributed import Client, Future

__all__ = ["solve", "submit"]


def submit(client: Client, folder: str | os.PathLike[str], retries: int = 2) -> list[Future[int]]:
    """Submits every task without a result to the workers of a ``dask.distributed.Client``, and returns their futures. The
    result of a future is the exit code of its fit; the report is stored in the folder. Tasks of a worker that dies are
    repeated by others; a task whose computation fails is repeated up to ``retries`` times."""
    path = str(pathlib.Path(folder).resolve())
    ids = _rodfit.Campaign(path).open_tasks()
    return [client.submit(solve, path, id, key=f"{id} in {path}", retries=retries) for id in ids]


def solve(folder: str | os.PathLike[str], id: str) -> int:
    """Solves one task of the plan in a folder and stores its result there. Returns the exit code that ``rodfit fit`` would
    have: 0 done; 2 bad input; 3 not converged or not identifiable."""
    campaign = _campaign(os.fspath(folder))
    if not campaign.has(id):
        # The campaign was planned again after this worker read it.
        _campaign.cache_clear()
        campaign = _campaign(os.fspath(folder))
    code = campaign.solve(id)
    if code is None:
        raise KeyboardInterrupt
    return code


@functools.lru_cache(maxsize=16)
def _campaign(folder: str) -> _rodfit.Campaign:
    """One in a process, so that all its results go into one file."""
    return _rodfit.Campaign(folder)
