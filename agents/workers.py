"""Processes that run episodes, on whose number nothing depends."""

import multiprocessing
import os
import signal
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from functools import partial
from multiprocessing import resource_tracker
from multiprocessing.connection import wait
from multiprocessing.process import BaseProcess
from typing import Annotated, Any, TypeVar

from tca_mj.checks import whole

Found = TypeVar("Found")

_STOPPING = [getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP")
             if hasattr(signal, name)]  # fmt: skip

Processes = Annotated[int, partial(whole, at_least=1, at_most=1024)]
"""How many at a time: as many as the largest machines have threads."""


class Workers:
    """Calls functions in processes of their own, or in this one if there is only one.

    They end with the process that has started them, however and whenever that ends. Ctrl-C, and
    signals to the whole group of processes, are for that one alone.
    """

    def __init__(self, count: int) -> None:
        self._count = count if count > 1 else 0
        self._processes: list[BaseProcess] = []
        self._pipes: list[Any] = []

    def __enter__(self) -> "Workers":
        # Spawned: nothing of this process, of its threads above all, is carried over.
        context = multiprocessing.get_context("spawn")
        try:
            for _ in range(self._count):
                ours, theirs = context.Pipe()
                process = context.Process(target=_work, args=(theirs,), daemon=True)
                with _deaf():
                    process.start()
                    self._processes.append(process)
                theirs.close()
                self._pipes.append(ours)
        except BaseException:
            self.__exit__()
            raise
        return self

    def __exit__(self, *error: object) -> None:
        for process in self._processes:
            process.kill()  # it has nothing to lose
        for process in self._processes:
            process.join()
        for pipe in self._pipes:
            pipe.close()

    def run(
        self, function: Callable[..., Found], jobs: Sequence[tuple[Any, ...]]
    ) -> Iterator[tuple[int, Found]]:
        """Yields the number of each job and what came of it, in any order.

        Args:
            function: A function of a module; what it raises is raised here.
            jobs: Its arguments, call by call.

        Raises:
            ChildProcessError: If a process has ended.
        """
        if not self._count:
            yield from ((i, function(*job)) for i, job in enumerate(jobs))
            return
        waiting, free = list(enumerate(jobs))[::-1], list(self._pipes)
        busy: dict[Any, int] = {}
        while waiting or busy:
            try:
                while free and waiting:
                    free[-1].send((function, waiting[-1][1]))
                    busy[free.pop()] = waiting.pop()[0]
                ready: list[Any] = wait(list(busy))
                answers = [(pipe, pipe.recv()) for pipe in ready]
            except (EOFError, OSError) as error:
                raise ChildProcessError(
                    "a process that ran episodes has ended: was there too little memory?"
                ) from error
            for pipe, answer in answers:
                if isinstance(answer, Exception):
                    raise answer
                free.append(pipe)
                yield busy.pop(pipe), answer


@contextmanager
def _deaf() -> Iterator[None]:
    """Lets the process that is started hear no signal to stop; this one hears it afterwards."""
    if not hasattr(signal, "pthread_sigmask"):  # Windows
        yield
        return
    resource_tracker.ensure_running()  # starting that would lift the mask
    before = signal.pthread_sigmask(signal.SIG_BLOCK, _STOPPING)
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _work(pipe: Any) -> None:
    """A process that does what it is told until the other end of its pipe is gone."""
    threading.Thread(target=_end_with_parent, daemon=True).start()
    try:
        while True:
            function, job = pipe.recv()
            try:
                answer = function(*job)
            except Exception as error:
                answer = error
            pipe.send(answer)
    except (EOFError, OSError):
        return


def _end_with_parent() -> None:
    parent = multiprocessing.parent_process()
    assert parent is not None
    wait([parent.sentinel])
    os._exit(1)
