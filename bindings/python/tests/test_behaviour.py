"""Threads, processes, signals, callbacks."""

import concurrent.futures
import io
import multiprocessing
import os
import signal
import subprocess
import sys
import threading
import time

import numpy as np
import pytest
from conftest import grid, same, sphere

import maille


@pytest.fixture(scope="module")
def big():
    """Takes about a second to compress."""
    rng = np.random.default_rng(2)
    mesh = sphere(200)
    return maille.Mesh(mesh.points + 0.001 * rng.random(mesh.points.shape), mesh.cells)


def test_progress_is_told_in_the_calling_thread(big):
    told = []
    data = maille.encode(big, progress=lambda stage, fraction: told.append((threading.get_ident(), stage, fraction)))
    assert {each[0] for each in told} == {threading.get_ident()}
    assert told[-1][2] == 1 and all(isinstance(stage, str) and 0 <= part <= 1 for _, stage, part in told)
    told.clear()
    maille.decode(data, progress=lambda *report: told.append(report))
    assert told


def test_progress_may_stop_the_work(big):
    with pytest.raises(KeyboardInterrupt):
        maille.encode(big, effort=9, progress=lambda stage, fraction: False)


def test_what_a_callback_raises_comes_through(big):
    class Mine(Exception):
        pass

    def fail(stage, fraction):
        raise Mine(stage)

    with pytest.raises(Mine):
        maille.encode(big, effort=9, progress=fail)
    with pytest.raises(Mine):
        maille.decode(maille.encode(sphere(3)), progress=fail)
    with pytest.raises(TypeError, match="progress: a function"):
        maille.encode(big, progress=5)


class Bar:
    """As tqdm's."""

    def __init__(self):
        self.n, self.total, self.stages, self.shown = 0, None, [], []

    def update(self, n):
        self.n += n

    def set_description(self, text, refresh=True):
        self.stages.append(text)

    def refresh(self):
        self.shown.append(self.n)


def test_a_bar_of_tqdm_is_moved(big):
    bar = Bar()
    maille.encode(big, progress=bar)
    assert bar.total == 100 and bar.shown[-1] == 100 and bar.stages
    tqdm = pytest.importorskip("tqdm")
    with tqdm.tqdm(file=io.StringIO()) as real:
        maille.encode(big, progress=real)
        assert real.n == 100


def test_a_file_object_that_raises_comes_through():
    data = maille.encode(grid(10))

    class Broken(io.BytesIO):
        calls = 0

        def read(self, *arguments):
            self.calls += 1
            if self.calls > 2:
                raise ConnectionError("the cable is out")
            return super().read(*arguments)

    with pytest.raises(ConnectionError, match="the cable is out"):
        maille.read(Broken(data))
    with pytest.raises(OSError, match="mode 'rb'"):
        maille.read(io.StringIO("text" * 100))

    class Short(io.BytesIO):
        def read(self, size=-1):
            return super().read(min(size, 100))

    assert same(maille.read(Short(data)), grid(10))


def test_ctrl_c_is_answered():
    code = """
import numpy as np, maille, os, signal, sys, threading, time
sys.path.insert(0, sys.argv[1])
from conftest import sphere
mesh = sphere(500)
signal.signal(signal.SIGINT, signal.default_int_handler)  # background jobs of a shell begin with it ignored
threading.Timer(1.0, lambda: os.kill(os.getpid(), signal.SIGINT)).start()
begin = time.process_time()
try:
    maille.encode(mesh, effort=9)
    print("done")
except KeyboardInterrupt:
    print("interrupted")
# All is well behind it.
assert maille.decode(maille.encode(sphere(5))).cell_count == sphere(5).cell_count
"""
    done = subprocess.run([sys.executable, "-c", code, os.path.dirname(__file__)], stdout=subprocess.PIPE, text=True,
                          timeout=100)
    assert done.returncode == 0 and done.stdout.strip() == "interrupted"


def test_other_threads_run_meanwhile(big):
    turns = 0
    stop = threading.Event()

    def count():
        nonlocal turns
        while not stop.wait(0.001):
            turns += 1

    thread = threading.Thread(target=count)
    thread.start()
    maille.encode(big, effort=7)
    stop.set()
    thread.join()
    assert turns > 20


def test_threads_work_at_once_and_on_one_handle():
    mesh = grid(12)
    data = maille.encode(mesh, pieces=200)
    file = maille.open(data)
    whole = [file.box([i, i, i], [i + 1, i + 1, i + 1]) for i in range(8)]
    with concurrent.futures.ThreadPoolExecutor(8) as pool:
        for _ in range(5):
            again = list(pool.map(lambda i: file.box([i, i, i], [i + 1, i + 1, i + 1]), range(8)))
            assert all(same(a, b) for a, b in zip(whole, again))
            assert all(same(each, mesh) for each in pool.map(lambda _: maille.decode(data), range(8)))
        assert set(pool.map(lambda _: maille.encode(mesh), range(8))) == {maille.encode(mesh)}


def _cells(data):
    return maille.decode(data).cell_count


def _mesh_of(data):
    return maille.decode(data)


def _piece(file, i):
    return file.piece(i).cell_count


@pytest.mark.parametrize("method", ["fork", "spawn", "forkserver"])
def test_processes_of_all_kinds(method):
    data = maille.encode(grid(12), pieces=200)
    assert _cells(data) == 1728  # the threads are there before the fork
    file = maille.open(data)
    context = multiprocessing.get_context(method)
    if method != "fork":
        context.set_forkserver_preload([]) if method == "forkserver" else None
    with context.Pool(2) as pool:
        assert pool.map(_cells, [data] * 4) == [1728] * 4
        assert sum(pool.starmap(_piece, [(file, i) for i in range(file.pieces)])) == 1728
        assert same(pool.apply(_mesh_of, [data]), maille.decode(data))


def test_a_fork_in_the_middle_of_work(big):
    """Of another thread, whose locks nobody will open in the child."""
    worker = threading.Thread(target=lambda: maille.encode(big, effort=7))
    worker.start()
    time.sleep(0.2)
    child = os.fork()
    if child == 0:
        signal.alarm(60)
        os._exit(0 if maille.decode(maille.encode(grid(6))).cell_count == 216 else 1)
    assert os.waitpid(child, 0)[1] == 0
    worker.join()


def test_the_number_of_threads_changes_nothing():
    mesh = sphere(60)
    try:
        files = set()
        for count in (1, 2, 5, 0):
            maille.set_threads(count)
            files.add(maille.encode(mesh))
            assert maille.decode(maille.encode(mesh)).cell_count == mesh.cell_count
        assert len(files) == 1
    finally:
        maille.set_threads(0)
    with pytest.raises(ValueError):
        maille.set_threads(-1)


def test_the_interpreter_ends_while_a_thread_works():
    code = """
import sys, threading, maille
sys.path.insert(0, sys.argv[1])
from conftest import sphere
mesh = sphere(300)
threading.Thread(target=lambda: maille.encode(mesh, effort=9), daemon=True).start()
"""
    done = subprocess.run([sys.executable, "-c", code, os.path.dirname(__file__)], timeout=100)
    assert done.returncode == 0
