"""Campaigns on the workers of Dask: scheduler and workers as processes, one of which is killed."""

import os
import pathlib
import signal
import subprocess
import sys
import time
from collections.abc import Iterator

import pytest

import rodfit
import rodfit.campaign

DATA = pathlib.Path(__file__).resolve().parents[2] / "data"

CAMPAIGN = f"""
fits = ["{DATA}/cantilever-fit.toml"]
[grid]
"rod.section.radius" = [4.9e-3, 5e-3, 5.1e-3, 5.2e-3]
material.density = [1200, 1250, 1300, 1350, 1400]
"rod.segments" = [10]
"time.step" = [4e-3]
"analysis.what_if" = [false]
"""


def command(*words: object) -> subprocess.CompletedProcess[bytes]:
    return subprocess.run([sys.executable, "-m", "rodfit", "campaign", *map(str, words)], check=True)


def plan(folder: pathlib.Path) -> pathlib.Path:
    (folder / "campaign.toml").write_text(CAMPAIGN)
    command("plan", folder / "campaign.toml", "--out", folder / "out")
    return folder / "out"


def collected(folder: pathlib.Path) -> bytes:
    command("collect", folder, "--out", folder / "all.jsonl", "-q")
    return (folder / "all.jsonl").read_bytes()


def results(folder: pathlib.Path) -> int:
    return sum(part.read_text().count("\n") for part in folder.glob("parts/*.jsonl"))


@pytest.fixture
def processes() -> Iterator[list[subprocess.Popen[bytes]]]:
    started: list[subprocess.Popen[bytes]] = []
    yield started
    for process in started:
        process.kill()
        process.wait()


def test_a_task_of_its_own(tmp_path: pathlib.Path) -> None:
    out = plan(tmp_path)
    ids = rodfit._rodfit.Campaign(out).open_tasks()
    assert len(ids) == 20 and rodfit.campaign.solve(out, ids[0]) == 0
    # Other data under the same names are another plan, which is read when it is asked for.
    (tmp_path / "campaign.toml").write_text(CAMPAIGN.replace("4e-3", "5e-3"))
    command("plan", tmp_path / "campaign.toml", "--out", out)
    other = rodfit._rodfit.Campaign(out).open_tasks()
    assert len(other) == 20 and rodfit.campaign.solve(out, other[0]) == 0
    with pytest.raises(rodfit.InputError, match="a task of the plan"):
        rodfit.campaign.solve(out, ids[0])
    assert results(out) == 2


def test_workers_that_die_change_nothing(tmp_path: pathlib.Path, processes: list[subprocess.Popen[bytes]]) -> None:
    distributed = pytest.importorskip("distributed")
    (tmp_path / "a").mkdir()
    out = plan(tmp_path / "a")

    def start(*words: str) -> subprocess.Popen[bytes]:
        log = open(tmp_path / f"{len(processes)}.log", "wb")
        process = subprocess.Popen(
            [sys.executable, "-m", *words], stdout=log, stderr=log, start_new_session=True, cwd=tmp_path
        )
        processes.append(process)
        return process

    file = tmp_path / "scheduler.json"
    start("distributed.cli.dask_scheduler", "--host", "127.0.0.1", "--port", "0", "--dashboard-address", ":0",
          "--no-dashboard", "--scheduler-file", str(file))
    workers = [
        # Without a nanny, which would begin it anew.
        start("distributed.cli.dask_worker", "--scheduler-file", str(file), "--host", "127.0.0.1", "--nthreads", "1",
              "--no-nanny", "--no-dashboard", "--local-directory", str(tmp_path))
        for _ in range(2)
    ]
    with distributed.Client(scheduler_file=str(file), timeout=60) as client:
        client.wait_for_workers(2, timeout=60)
        futures = rodfit.campaign.submit(client, out)
        assert len(futures) == 20
        while results(out) < 5:
            time.sleep(0.01)
        os.kill(workers[0].pid, signal.SIGKILL)
        assert results(out) < 20
        assert client.gather(futures) == [0] * 20
        assert rodfit.campaign.submit(client, out) == []
    # Of both, and the same bytes as without Dask.
    assert len(list(out.glob("parts/*.jsonl"))) == 2
    (tmp_path / "b").mkdir()
    alone = plan(tmp_path / "b")
    command("run", alone, "--threads", "1", "-q")
    assert collected(out) == collected(alone)
