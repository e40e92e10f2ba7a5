"""Campaigns on the workers of Dask, for who has no job scheduler, or one that dask-jobqueue knows::

    import rodfit.campaign
    from dask.distributed import Client, LocalCluster, wait

    if __name__ == "__main__":
        with Client(LocalCluster(threads_per_worker=1)) as client:
            wait(rodfit.campaign.submit(client, "out"))

Plan it with ``rodfit campaign plan campaign.toml --out out``, and collect with ``rodfit campaign collect out``: results are the same
bytes as those of ``rodfit campaign run``, and are stored as they come, in the same folder, which all workers must see.
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
    """Hands every task that has no result to the workers of a ``dask.distributed.Client``, and returns their futures. A
    future's result is the exit code of its fit; what was found is in the folder. A worker that dies costs the tasks it was
    at, which others then do; a task whose computation fails is tried again, ``retries`` times."""
    path = str(pathlib.Path(folder).resolve())
    ids = _rodfit.Campaign(path).open_tasks()
    return [client.submit(solve, path, id, key=f"{id} in {path}", retries=retries) for id in ids]


def solve(folder: str | os.PathLike[str], id: str) -> int:
    """Solves one task of the plan in a folder and stores its result there. Returns the exit code that ``rodfit fit`` would
    have: 0 done; 2 bad input; 3 not converged or not identifiable."""
    campaign = _campaign(os.fspath(folder))
    if not campaign.has(id):
        # It was planned again since this worker read it.
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
