"""test_ctypes.py LIBRARY: maille from Python without a compiler, and without anything but the standard library."""

import array
import ctypes
import functools
import http.server
import os
import sys
import tempfile
import threading
import unittest
from ctypes import POINTER, byref, c_char_p, c_double, c_int32, c_int64, c_uint32, c_uint64, c_void_p

lib = ctypes.CDLL(sys.argv.pop(1))


def declare(name, result, *arguments):
    function = getattr(lib, name)
    function.restype, function.argtypes = result, arguments
    return function


READ_AT = ctypes.CFUNCTYPE(c_int32, c_void_p, c_uint64, c_void_p, c_uint64)
WRITE = ctypes.CFUNCTYPE(c_int32, c_void_p, c_void_p, c_uint64)
PROGRESS = ctypes.CFUNCTYPE(c_int32, c_void_p, c_char_p, c_double)

error_create = declare('maille_error_create', c_void_p)
error_code = declare('maille_error_code', c_int32, c_void_p)
error_message = declare('maille_error_message', c_char_p, c_void_p)
mesh_create = declare('maille_mesh_create', c_void_p, c_void_p)
mesh_free = declare('maille_mesh_free', None, c_void_p)
set_points = declare('maille_mesh_set_points', c_int32, c_void_p, c_int32, c_uint64, c_void_p, c_int32, c_void_p)
add_block = declare('maille_mesh_add_block', c_int32, c_void_p, c_char_p, c_int32, c_uint64, c_void_p, c_void_p, c_uint64,
                    c_void_p, c_int32, c_void_p)
add_array = declare('maille_mesh_add_array', c_int32, c_void_p, c_char_p, c_int32, c_int32, c_uint32, c_uint64, c_void_p,
                    c_int32, c_int32, c_void_p)
points = declare('maille_mesh_points', c_uint64, c_void_p)
cells = declare('maille_mesh_cells', c_uint64, c_void_p)
positions_of = declare('maille_mesh_positions', c_void_p, c_void_p)
connectivity_of = declare('maille_block_connectivity', POINTER(c_uint32), c_void_p, c_uint64, POINTER(c_uint64))
compare = declare('maille_compare', c_int32, c_void_p, c_void_p, c_int32, c_void_p)
options_create = declare('maille_encode_options_create', c_void_p, c_void_p)
set_progress = declare('maille_encode_options_set_progress', c_int32, c_void_p, PROGRESS, c_void_p, c_void_p)
sink_memory = declare('maille_sink_memory', c_void_p, c_void_p)
sink_callbacks = declare('maille_sink_callbacks', c_void_p, WRITE, c_void_p, c_void_p, c_char_p, c_void_p)
sink_size = declare('maille_sink_size', c_uint64, c_void_p)
sink_bytes = declare('maille_sink_bytes', c_void_p, c_void_p)
sink_free = declare('maille_sink_free', None, c_void_p)
source_memory = declare('maille_source_memory', c_void_p, c_char_p, c_uint64, c_void_p)
source_open = declare('maille_source_open', c_void_p, c_char_p, c_void_p)
source_callbacks = declare('maille_source_callbacks', c_void_p, c_uint64, READ_AT, c_void_p, c_char_p, c_void_p)
source_free = declare('maille_source_free', None, c_void_p)
encode = declare('maille_encode', c_int32, c_void_p, c_void_p, c_void_p, c_void_p)
decode = declare('maille_decode', c_void_p, c_void_p, c_void_p, c_void_p)
read_mesh = declare('maille_read_mesh', c_void_p, c_char_p, c_void_p, c_void_p)

F32, COPY, BORROW, TRIANGLE, CANNOT_READ, CANCELLED = 8, 0, 1, 5, 3, 130
error = error_create()


def grid(n):
    """Positions and triangles of a square of n x n quads, as array.array."""
    at = array.array('f')
    triangles = array.array('I')
    for j in range(n + 1):
        for i in range(n + 1):
            at.extend([i / n, j / n, (i * j % 7) / 50])
    for j in range(n):
        for i in range(n):
            a = j * (n + 1) + i
            triangles.extend([a, a + 1, a + n + 2, a, a + n + 2, a + n + 1])
    return at, triangles


def mesh_of(at, triangles, how=BORROW):
    mesh = mesh_create(error)
    assert set_points(mesh, F32, len(at) // 3, at.buffer_info()[0], how, error) == 0
    assert add_block(mesh, b'grid', TRIANGLE, len(triangles) // 3, None, triangles.buffer_info()[0], len(triangles), None, how,
                     error) == 0
    return mesh


class Library(unittest.TestCase):
    def setUp(self):
        self.at, self.triangles = grid(30)
        self.mesh = mesh_of(self.at, self.triangles)

    def tearDown(self):
        mesh_free(self.mesh)

    def file(self):
        sink = sink_memory(error)
        self.assertEqual(encode(self.mesh, None, sink, error), 0)
        content = ctypes.string_at(sink_bytes(sink), sink_size(sink))
        sink_free(sink)
        return content

    def test_arrays_are_read_in_place_and_come_back(self):
        self.assertEqual(positions_of(self.mesh), self.at.buffer_info()[0])
        content = self.file()
        source = source_memory(content, len(content), error)
        back = decode(source, None, error)
        self.assertEqual(compare(self.mesh, back, 0, error), 0)
        count = c_uint64()
        corners = connectivity_of(back, 0, byref(count))
        self.assertEqual(count.value, len(self.triangles))
        self.assertLess(max(corners[:count.value]), points(back))
        mesh_free(back)
        source_free(source)

    def test_functions_of_python_are_read_from_and_written_to(self):
        written = bytearray()

        @WRITE
        def write(_user, data, size):
            written.extend(ctypes.string_at(data, size))
            return 0

        sink = sink_callbacks(write, None, None, b'a bytearray', error)
        self.assertEqual(encode(self.mesh, None, sink, error), 0)
        sink_free(sink)
        self.assertEqual(bytes(written), self.file())

        @READ_AT
        def read_at(_user, offset, out, size):
            ctypes.memmove(out, bytes(written[offset:offset + size]), size)
            return 0

        source = source_callbacks(len(written), read_at, None, b'a bytearray', error)
        back = decode(source, None, error)
        self.assertEqual(cells(back), 1800)
        mesh_free(back)
        source_free(source)

    def test_progress_stops_a_job(self):
        told = []

        @PROGRESS
        def progress(_user, stage, fraction):
            told.append((stage, fraction))
            return 1

        options = options_create(error)
        self.assertEqual(set_progress(options, progress, None, error), 0)
        sink = sink_memory(error)
        self.assertEqual(encode(self.mesh, options, sink, error), CANCELLED)
        self.assertTrue(told)
        sink_free(sink)

    def test_errors_are_sentences(self):
        self.assertIsNone(source_open(b'/no/such/file.maille', error))
        self.assertEqual(error_code(error), CANNOT_READ)
        self.assertIn(b'/no/such/file.maille', error_message(error))

    def test_an_address_is_read_like_a_path(self):
        class Quiet(http.server.SimpleHTTPRequestHandler):
            def log_message(self, *_):
                pass

        with tempfile.TemporaryDirectory() as folder:
            with open(os.path.join(folder, 'grid.maille'), 'wb') as file:
                file.write(self.file())
            server = http.server.ThreadingHTTPServer(('127.0.0.1', 0), functools.partial(Quiet, directory=folder))
            threading.Thread(target=server.serve_forever, daemon=True).start()
            address = f'http://127.0.0.1:{server.server_port}/grid.maille'.encode()
            back = read_mesh(address, None, error)
            server.shutdown()
            server.server_close()
        if back is None and b'libcurl' in error_message(error):
            self.skipTest(error_message(error).decode())
        self.assertIsNotNone(back, error_message(error))
        self.assertEqual(compare(self.mesh, back, 0, error), 0)
        mesh_free(back)

    def test_threads_of_python_have_objects_of_their_own(self):
        content = self.file()
        good = []

        def work():
            mine = error_create()
            source = source_memory(content, len(content), mine)
            for _ in range(5):
                back = decode(source, None, mine)
                good.append(cells(back) == 1800)
                mesh_free(back)
            source_free(source)

        threads = [threading.Thread(target=work) for _ in range(2)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        self.assertEqual(good, [True] * 10)


if __name__ == '__main__':
    unittest.main()
