"""Where runs are made: on this machine, or by Dask. Each takes tasks and gives outcomes as they come."""
from __future__ import annotations

import os
import queue
import threading
from contextlib import ExitStack, suppress
from typing import Any, Iterator, Mapping, Sequence

from .._library import ArgumentError, Error, UnsupportedError
from .engine import Engine, run_here

Tasks = Sequence[Mapping[str, Any]]
Outcomes = Iterator[tuple[int, dict[str, Any]]]

CONNECT = 10.0  # s, for a Dask scheduler to answer


class Local:
    """Workers on this machine, each a process that stays. A worker that is killed is replaced, and its run
    made again."""

    def __init__(self, workers: int | None = None):
        self.workers = workers or len(os.sched_getaffinity(0))
        self.engines: list[Engine] = []

    def __enter__(self) -> Local:
        self.engines = [Engine() for _ in range(self.workers)]
        return self

    def __exit__(self, *_: object) -> None:
        for engine in self.engines:
            engine.close()

    def map(self, tasks: Tasks) -> Outcomes:
        """(index, outcome) of each task, in the order in which they end. To be closed by who stops early."""
        waiting: queue.SimpleQueue[int | None] = queue.SimpleQueue()
        ended: queue.SimpleQueue[tuple[int, Any]] = queue.SimpleQueue()
        for i in range(len(tasks)):
            waiting.put(i)

        def work(engine: Engine) -> None:
            while (i := waiting.get()) is not None:
                try:
                    ended.put((i, engine.run(tasks[i])))
                except BaseException as error:  # raised in the caller's thread
                    ended.put((i, error))

        threads = [threading.Thread(target=work, args=(engine,), daemon=True)
                   for engine in self.engines[:len(tasks)]]
        for _ in threads:
            waiting.put(None)
        for thread in threads:
            thread.start()
        try:
            for _ in range(len(tasks)):
                i, outcome = ended.get()
                if isinstance(outcome, BaseException):
                    raise outcome
                yield i, outcome
        except BaseException:  # the caller has stopped, or a run raised: what runs is ended
            for engine in self.engines:
                engine.end()
            raise
        finally:
            with suppress(queue.Empty):
                while True:
                    waiting.get_nowait()
            for _ in threads:
                waiting.put(None)
            for thread in threads:
                thread.join()


class Dask:
    """Workers of a Dask cluster: of the scheduler at an address, or of a local cluster. Clusters on SLURM,
    PBS and Kubernetes are started by Dask's own deployers, which give the address."""

    def __init__(self, workers: int | None = None, address: str = ""):
        try:
            import distributed
        except ImportError:
            raise UnsupportedError("the executor dask needs dask.distributed for this Python: Debian's "
                                   "python3-distributed, or pip install distributed; the executor local does "
                                   "without", "DFM_E_UNSUPPORTED") from None
        self.distributed, self.workers, self.address = distributed, workers, address

    def __enter__(self) -> Dask:
        with ExitStack() as stack:
            cluster = self.address or stack.enter_context(self.distributed.LocalCluster(
                n_workers=self.workers or len(os.sched_getaffinity(0)), threads_per_worker=1,
                dashboard_address=None))
            try:
                self.client = stack.enter_context(self.distributed.Client(cluster, timeout=CONNECT))
            except (OSError, ValueError) as error:
                raise ArgumentError(f"no Dask scheduler answers at {self.address}: {error}",
                                    "DFM_E_ARG") from None
            self.open = stack.pop_all()
        return self

    def __exit__(self, *_: object) -> None:
        self.open.close()

    def map(self, tasks: Tasks) -> Outcomes:
        futures = self.client.map(run_here, list(tasks), pure=False)
        index = {future.key: i for i, future in enumerate(futures)}
        for future in self.distributed.as_completed(futures):
            error = future.exception()
            if isinstance(error, self.distributed.KilledWorker):  # as often as Dask allows: it is the run
                yield index[future.key], {"state": "failed", "said": f"Dask gave it up: {error}",
                                          "seconds": 0.0}
            elif error:
                raise Error(f"a worker of Dask cannot make runs: {type(error).__name__}: {error}; it needs "
                            f"this version of deform and the study's files at the same paths")
            else:
                yield index[future.key], future.result()


EXECUTORS = ("local", "dask")


def executor(name: str, workers: int | None = None, address: str = "") -> Local | Dask:
    if workers is not None and workers < 1:
        raise ArgumentError(f"workers is {workers}; it must be 1 or more", "DFM_E_ARG")
    if address and name != "dask":
        raise ArgumentError("address is of the executor dask: give that one, too, or omit address",
                            "DFM_E_ARG")
    if address and workers is not None:
        raise ArgumentError("the scheduler at address has its own workers: omit workers, or address",
                            "DFM_E_ARG")
    if name == "local":
        return Local(workers)
    if name == "dask":
        return Dask(workers, address)
    raise ArgumentError(f'there is no executor "{name}"; there are {", ".join(EXECUTORS)}', "DFM_E_ARG")
