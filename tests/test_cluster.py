"""Two nodes of a Ray cluster, one of them killed half-way: nothing that was finished is lost, and
all that comes out is what one process finds."""

import shutil
import statistics
import tempfile
import threading
from contextlib import contextmanager, suppress
from pathlib import Path

import numpy as np
import pytest

from tca_mj.agents.cluster import ClusterWorkers
from tca_mj.agents.evaluate import Evaluation
from tca_mj.agents.policies import SavedPolicy
from tca_mj.agents.sweep import TRIALS, Sweep, run_sweep
from tca_mj.agents.train.search import SearchConfig, search

REACH, WALK = "TCA/BendReach-v0", "TCA/TetrapodWalk-v0"


@pytest.fixture
def two_nodes(monkeypatch):
    """The cluster and its second node."""
    pytest.importorskip("ray")
    monkeypatch.setenv("RAY_AUTH_MODE", "disabled")
    monkeypatch.setenv("RAY_USAGE_STATS_ENABLED", "0")
    # Paths of sockets have at most 107 bytes, and that of the tests' own folder grows.
    folder = tempfile.mkdtemp(prefix="two-", dir="/tmp")
    monkeypatch.setenv("RAY_TMPDIR", folder)
    from ray.cluster_utils import Cluster

    nodes = Cluster(initialize_head=True,
                    head_node_args={"num_cpus": 1, "include_dashboard": False})  # fmt: skip
    second = nodes.add_node(num_cpus=1)
    nodes.wait_for_nodes()
    yield nodes, second
    with suppress(Exception):  # one of them is not there any more
        nodes.shutdown()
    shutil.rmtree(folder, ignore_errors=True)


@contextmanager
def killed_when(nodes, second, ready, watched=lambda: None):
    """Kills the second node as soon as something is there, and watches until the end."""
    over, killed = threading.Event(), []

    def watch():
        while not over.wait(0.05):
            watched()
            if not killed and ready():
                nodes.remove_node(second, allow_graceful=False)
                killed.append(second)

    watcher = threading.Thread(target=watch)
    watcher.start()
    try:
        yield
    finally:
        over.set()
        watcher.join()
    assert killed


def rows(file):
    return len(file.read_text().splitlines()) if file.is_file() else 0


@pytest.mark.long
def test_a_search_on_two_nodes_finds_what_one_process_finds(tmp_path, two_nodes):
    nodes, second = two_nodes
    config = SearchConfig(task=WALK, steps=3000, population=5, settling=0.5, window=3.0,
                          validation_episodes=2, validate_every=2)  # fmt: skip
    curve = tmp_path / "spread" / "curve.csv"
    with killed_when(nodes, second, lambda: rows(curve) > 3):
        search(config, tmp_path / "spread", address=nodes.address, progress=False)
    search(config, tmp_path / "alone", workers=1, progress=False)
    assert rows(curve) > 6
    assert curve.read_bytes() == (tmp_path / "alone" / "curve.csv").read_bytes()
    best = [SavedPolicy.read(tmp_path / each / "best.json") for each in ("spread", "alone")]
    assert best[0].gait == best[1].gait


@pytest.mark.long
def test_trainings_of_a_node_that_is_killed_finish_elsewhere(tmp_path, two_nodes):
    """By tasks and seeds. A curve never gets shorter: no interval is lost."""
    nodes, second = two_nodes
    sweep = Sweep(
        evaluation=Evaluation(task=REACH, episodes=2, steps=20), algorithm="sac",
        axes={"train.seed": (0, 1, 2), "train.steps": (1500,), "train.interval": (250,),
              "train.envs": (2,)},
    )  # fmt: skip
    out, lengths = tmp_path / "out", {}
    curves = [out / TRIALS / trial.name / "curve.csv" for trial in sweep.trials()]

    def watched():
        for curve in curves:
            lengths.setdefault(curve, []).append(rows(curve))

    with killed_when(nodes, second, lambda: all(rows(c) > 2 for c in curves[:2]), watched):
        found = run_sweep(sweep, out, workers=2, address=nodes.address)
    for row, trial, curve in zip(found, sweep.trials(), curves, strict=True):
        seen = np.array(lengths[curve])
        assert (np.diff(seen) >= 0).all() and len(set(seen)) > 3
        alone = tmp_path / "alone" / trial.name
        assert trial.run(alone)["figures"] == row["figures"]
        assert (alone / "curve.csv").read_bytes() == curve.read_bytes()
        spread, same = (SavedPolicy.read(folder / "best.npz") for folder in (curve.parent, alone))
        for one, other in zip(spread.network.weights, same.network.weights, strict=True):
            assert np.array_equal(one, other)


@pytest.mark.long
def test_what_a_call_raises_is_raised_here(tmp_path, two_nodes):
    with ClusterWorkers(Path(tmp_path), two_nodes[0].address) as workers:
        assert dict(workers.run(statistics.mean, [([1, 2],), ([3, 4],)])) == {0: 1.5, 1: 3.5}
        with pytest.raises(statistics.StatisticsError):
            list(workers.run(statistics.mean, [([1, 2],), ([],)]))
