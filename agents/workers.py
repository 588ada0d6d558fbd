"""Processes that run episodes, on whose number nothing depends."""

import multiprocessing
import signal
import threading
from collections.abc import Callable, Iterator, Sequence
from multiprocessing.connection import wait
from multiprocessing.process import BaseProcess
from typing import Any, TypeVar

Found = TypeVar("Found")


class Workers:
    """Calls functions in processes of their own, or in this one if there is only one.

    They end with the process that has started them, however that ends.
    """

    def __init__(self, count: int) -> None:
        self._count = count if count > 1 else 0
        self._processes: list[BaseProcess] = []
        self._pipes: list[Any] = []

    def __enter__(self) -> "Workers":
        # Spawned: nothing of this process, of its threads above all, is carried over. Ctrl-C is
        # for this process alone; one that is started while it is ignored never hears of it.
        context = multiprocessing.get_context("spawn")
        alone = threading.current_thread() is threading.main_thread()
        before = signal.signal(signal.SIGINT, signal.SIG_IGN) if self._count and alone else None
        try:
            for _ in range(self._count):
                ours, theirs = context.Pipe()
                process = context.Process(target=_work, args=(theirs,), daemon=True)
                process.start()
                theirs.close()
                self._pipes.append(ours)
                self._processes.append(process)
        finally:
            if before is not None:
                signal.signal(signal.SIGINT, before)
        return self

    def __exit__(self, *error: object) -> None:
        for pipe, process in zip(self._pipes, self._processes, strict=True):
            process.kill()  # it has nothing to lose
            pipe.close()

    def run(
        self, function: Callable[..., Found], jobs: Sequence[tuple[Any, ...]]
    ) -> Iterator[tuple[int, Found]]:
        """Yields the number of each job and what came of it, in any order.

        Args:
            function: A function of a module; what it raises is raised here.
            jobs: Its arguments, call by call.

        Raises:
            RuntimeError: If a process has ended.
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
                raise RuntimeError("a process that ran episodes has ended") from error
            for pipe, answer in answers:
                if isinstance(answer, Exception):
                    raise answer
                free.append(pipe)
                yield busy.pop(pipe), answer


def _work(pipe: Any) -> None:
    """A process that does what it is told until the other end of its pipe is gone."""
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
