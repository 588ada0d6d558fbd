"""Ray: a cluster in this machine, which nobody else reaches and leaves nothing, or another one."""

from __future__ import annotations

import hashlib
import os
import secrets
import shutil
import signal
import sys
import tempfile
import threading
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from functools import cache, partial
from pathlib import Path
from typing import Annotated, Any

from tca_mj.agents.workers import Found
from tca_mj.checks import whole

Failures = Annotated[int, partial(whole, at_least=0, at_most=100)]
"""How often what a process or machine did that was lost is begun again."""

_TRIES = 3  # to start; on a busy machine Ray gives up after half a minute
_SHORT = 18  # length of a folder in which the paths of sockets are not too long for any system

# What Ray is told: not to report its use, to leave Ctrl-C to us; and its switch for the loopback
# address, which it reads when it is imported.
_USUAL = {"RAY_USAGE_STATS_ENABLED": "0", "TUNE_DISABLE_SIGINT_HANDLER": "1"}
_OWN = {"RAY_ENABLE_WINDOWS_OR_OSX_CLUSTER": "0"}


@contextmanager
def cluster(out: Path, workers: int, address: str | None) -> Iterator[None]:
    """A cluster to work with; one that this process has joined already stays joined.

    Args:
        out: What the work is for: one of these at a time.
        workers: Cores of a cluster in this machine.
        address: Of one that is running, as ``ray.init`` takes it; None for one in this machine.

    Raises:
        ImportError: If Ray is not installed.
        ConnectionError: If there is none at ``address``.
        RuntimeError: If it does not start.
    """
    with ExitStack() as ends:
        ends.enter_context(_environment(_USUAL if address else _USUAL | _OWN))
        import ray

        if not ray.is_initialized():
            told: dict[str, Any] = {"address": address}
            if address is None:
                told = ends.enter_context(_own(out, workers))
            ends.callback(ray.shutdown)
            _start(told)
        yield


class ClusterWorkers:
    """Calls functions on the cores of a running cluster, as ``Workers`` does in processes.

    What a machine was doing that is lost is done again by another one.
    """

    def __init__(self, out: Path, address: str, failures: Failures = 3) -> None:
        """A cluster to be joined on entry.

        Args:
            out: What the work is for.
            address: Of the cluster, as ``ray.init`` takes it.
            failures: How often a call is made again whose process or machine was lost.
        """
        self._cluster = cluster(out, 1, address)
        self._failures = failures

    def __enter__(self) -> ClusterWorkers:
        self._cluster.__enter__()
        return self

    def __exit__(self, *error: Any) -> None:
        self._cluster.__exit__(*error)

    def run(
        self, function: Callable[..., Found], jobs: Sequence[tuple[Any, ...]]
    ) -> Iterator[tuple[int, Found]]:
        """As ``Workers.run``; ``ChildProcessError`` if a call was lost too often."""
        import ray
        from ray.exceptions import RayError, RayTaskError

        remote = ray.remote(num_cpus=1, max_retries=self._failures)(function)
        pending = {remote.remote(*job): i for i, job in enumerate(jobs)}
        try:
            while pending:
                for reference in ray.wait(list(pending))[0]:
                    try:
                        answer = ray.get(reference)
                    except RayTaskError as error:
                        raise error.cause from None
                    except RayError as error:
                        raise ChildProcessError(f"the cluster lost a call: {error}") from error
                    yield pending.pop(reference), answer
        finally:
            for reference in pending:  # what nobody waits for any more
                ray.cancel(reference, force=True)


@cache
def _token() -> str:
    """What opens the clusters of this process; Ray remembers the first that it is told."""
    return secrets.token_hex(32)


def _start(told: Mapping[str, Any]) -> None:
    """Starts or joins it, and leaves SIGTERM to whom it belonged before."""
    import ray

    variables = {"OMP_NUM_THREADS": "1", "PYTHONPATH": os.environ.get("PYTHONPATH", "")}
    before = signal.getsignal(signal.SIGTERM)
    try:
        for left in reversed(range(_TRIES)):
            try:
                ray.init(**told, log_to_driver=False, runtime_env={"env_vars": variables})
                return
            except ConnectionError:
                raise
            except Exception as error:
                ray.shutdown()
                if not left:
                    raise RuntimeError(f"Ray does not start: {error}") from error
    finally:
        if threading.current_thread() is threading.main_thread():
            signal.signal(signal.SIGTERM, before)


@contextmanager
def _own(out: Path, workers: int) -> Iterator[dict[str, Any]]:
    """What Ray is told of a cluster that nobody else is to reach: by the machine's own address
    alone, and with a token that is nowhere but in its processes.
    """
    from ray._private import ray_constants

    before = ray_constants.ENABLE_RAY_CLUSTER  # it may have been imported without ``_OWN``
    ray_constants.ENABLE_RAY_CLUSTER = False
    try:
        with _environment({"RAY_AUTH_TOKEN": _token()}), _temporary(out) as folder:
            yield {"address": "local", "num_cpus": workers, "include_dashboard": False,
                   "_temp_dir": str(folder)}  # fmt: skip
    finally:
        ray_constants.ENABLE_RAY_CLUSTER = before


@contextmanager
def _environment(variables: Mapping[str, str]) -> Iterator[None]:
    """Environment variables for a while, where they are not set."""
    new = {name: value for name, value in variables.items() if name not in os.environ}
    os.environ.update(new)
    try:
        yield
    finally:
        for name in new:
            os.environ.pop(name, None)


@contextmanager
def _temporary(out: Path) -> Iterator[Path]:
    """A folder for what Ray keeps while it runs, its sockets above all, whose paths must be short.

    What work into the same folder that was killed has left of it is removed first.
    """
    mark = f"tca-mj-{hashlib.sha256(str(out).encode()).hexdigest()[:6]}-"
    usual = os.environ.get("RAY_TMPDIR", tempfile.gettempdir())
    where = Path(usual if len(usual) < _SHORT or sys.platform == "win32" else "/tmp")
    for old in where.glob(f"{mark}*"):
        shutil.rmtree(old, ignore_errors=True)
    folder = Path(tempfile.mkdtemp(prefix=mark, dir=where))
    try:
        yield folder
    finally:
        shutil.rmtree(folder, ignore_errors=True)
