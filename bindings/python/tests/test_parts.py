"""Files of which parts are read: random access, streams, addresses."""

import functools
import http.server
import io
import pickle
import threading

import numpy as np
import pytest
from conftest import all_kinds, grid, same, sphere

import maille


@pytest.fixture(scope="module")
def volume():
    """16^3 hexahedra in pieces of about 300."""
    mesh = grid(16)
    return mesh, maille.encode(mesh, pieces=300)


@pytest.fixture(scope="module")
def surface():
    mesh = sphere(100, point_data={"h": sphere(100).points[:, 2].copy()})
    return mesh, maille.encode(mesh, mode="random", effort=2)


def boxes_of(mesh):
    corners = mesh.points[mesh.cells[0].connectivity]
    return corners.min(axis=1), corners.max(axis=1)


def test_a_box_has_exactly_the_cells_that_meet_it(volume):
    mesh, data = volume
    low, high = boxes_of(mesh)
    with maille.open(data) as file:
        assert file.mode == "stream" and file.pieces > 5 and file.levels == ()
        for box in (([2, 2, 2], [5.5, 3, 9]), ([-9, -9, -9], [99, 99, 99]), ([50, 50, 50], [60, 60, 60])):
            wanted = ((low <= box[1]) & (high >= box[0])).all(axis=1)
            part = file.box(*box)
            assert sorted(part.cell_numbers.tolist()) == np.flatnonzero(wanted).tolist()
            for name in ("p", "id"):
                if part.cell_count:
                    assert (part.cell_data[name] == mesh.cell_data[name][part.cell_numbers]).all()
            if part.cell_count:
                assert (part.points == mesh.points[part.point_numbers]).all()


def test_values_choose_cells(volume):
    mesh, data = volume
    file = maille.open(data, arrays=["id"])
    part = file.where("p", 100, 10000)
    wanted = (mesh.cell_data["p"] >= 100) & (mesh.cell_data["p"] <= 10000)
    assert sorted(part.cell_numbers.tolist()) == np.flatnonzero(wanted).tolist()
    assert list(part.cell_data) == ["id"] and not part.point_data
    fast = file.where("v", low=30, component=0)
    v = mesh.point_data["v"][:, 0][mesh.cells[0].connectivity]
    assert fast.cell_count == (v >= 30).any(axis=1).sum()
    both = file.extract(box=([0, 0, 0], [4, 4, 4]), where=[("p", 0, 5000)])
    assert 0 < both.cell_count < part.cell_count + 80
    with pytest.raises(maille.Error, match="nothing"):
        file.where("nothing", 1, 2)
    with pytest.raises(TypeError, match="least, largest"):
        file.extract(where=["p > 5"])


def test_planes_spheres_and_numbers(volume):
    mesh, data = volume
    file = maille.open(data)
    low, high = boxes_of(mesh)
    part = file.extract(plane=([0, 0, 4.5], [0, 0, -3]))
    assert part.cell_count == 256 and part.slice([0, 0, 4.5], [0, 0, 1]).cell_count == 256
    assert file.extract(cells=(10, 20)).cell_numbers.tolist() == list(range(10, 20))
    assert 0 < file.extract(sphere=([8, 8, 8], 1.5)).cell_count < 200
    assert file.extract(planes=[([0, 0, 15.5], [0, 0, 1])]).cell_count == 256


def test_pieces_are_the_whole(volume, surface):
    for mesh, data in (volume, surface):
        with maille.open(data) as file:
            parts = [file.piece(i) for i in range(file.pieces)]
            about = [file.piece_info(i) for i in range(file.pieces)]
        assert sum(part.cell_count for part in parts) == mesh.cell_count
        for part, each in zip(parts, about):
            assert each.cells == part.cell_count
            assert (np.array(each.low) <= part.bounds[0] + 1e-6).all()
            assert (np.array(each.high) >= part.bounds[1] - 1e-6).all()
    with maille.open(volume[1]) as file:
        low, high = file.piece_info(0).ranges["p"][0]
        assert low <= file.piece(0).cell_data["p"].min() and high >= file.piece(0).cell_data["p"].max()
        with pytest.raises(IndexError, match="counted from 0"):
            file.piece(file.pieces)
        assert file.piece(-1).cell_count == file.piece(file.pieces - 1).cell_count


def test_a_surface_at_every_level(surface):
    mesh, data = surface
    with maille.open(data) as file:
        assert file.mode == "random" and len(file.levels) > 1
        assert file.levels[0].faces == mesh.cell_count
        counts = [file.extract(level=i).cell_count for i in range(len(file.levels))]
        assert counts == sorted(counts, reverse=True) and counts[0] == mesh.cell_count
        assert mesh.differences(file.extract()) == []
        assert file.coarse().cell_count == file.levels[-1].faces
        assert file.extract(triangles=20000).cell_count <= 20000
        rough = file.extract(error=0.01)
        assert rough.cell_count < mesh.cell_count
        assert np.abs(np.linalg.norm(rough.points, axis=1) - 1).max() <= 0.011
        assert file.view([0, 0, 1000]).cell_count == counts[-1] and file.view([0, 0, 1.01]).cell_count == counts[0]
        part = file.box([0, 0, 0], [2, 2, 2])
        assert (part.points.max(axis=0) > 0.9).all() and part.cell_count < mesh.cell_count / 4
        assert file.box([0, 0, 0], [2, 2, 2], whole=True).cell_count > part.cell_count
        with pytest.raises(IndexError, match="counted from 0"):
            file.extract(level=50)


def test_places_on_a_surface(surface):
    mesh, data = surface
    with maille.open(data) as file:
        hit = file.hit([0, 0.01, 5], [0, 0, -2])
        assert hit.position == pytest.approx((0, 0.01, 1), abs=1e-3) and hit.distance == pytest.approx(2, abs=1e-3)
        assert file.hit([5, 5, 5], [1, 0, 0]) is None
        assert file.nearest([3, 0, 0]).distance == pytest.approx(2, abs=1e-3)
        points, distances = file.nearest_points([0, 0, 2], 5)
        assert points.shape == (5, 3) and (np.diff(distances) >= 0).all() and points[0].tolist() == [0, 0, 1]
        assert file.component([0, 0, 9]).cell_count == mesh.cell_count


def test_what_a_mode_does_not_have_is_said(volume, surface):
    for data, wrong, sentence in (
            (maille.encode(sphere(5)), lambda file: file.box([0, 0, 0], [1, 1, 1]), "mode single, which is read whole"),
            (volume[1], lambda file: file.extract(level=1), "levels of detail"),
            (volume[1], lambda file: file.nearest([0, 0, 0]), "nearest.. is for mode random"),
            (surface[1], lambda file: file.where("h", 0, 1), "for volumes"),
            (surface[1], lambda file: file.extract(plane=([0, 0, 0], [0, 0, 1])), "for volumes")):
        with pytest.raises(maille.Error, match=sentence) as raised:
            wrong(maille.open(data))
        assert raised.value.code == maille.ErrorCode.UNSUPPORTED
    single = maille.open(maille.encode(sphere(5)))
    assert single.pieces == 1 and single.piece(0).cell_count == sphere(5).cell_count
    with pytest.raises(ValueError, match="lowest corner comes first"):
        maille.open(volume[1]).box([1, 1, 1], [0, 0, 0])
    with pytest.raises(ValueError, match="three numbers"):
        maille.open(volume[1]).box([1, 1], [0, 0, 0])


def test_a_closed_file_says_so(volume):
    file = maille.open(volume[1])
    part = file.box([0, 0, 0], [2, 2, 2])
    file.close()
    for use in (file.read, lambda: file.box([0, 0, 0], [1, 1, 1]), lambda: file.fetched):
        with pytest.raises(ValueError, match="closed"):
            use()
    assert part.points.sum() > 0 and repr(file) == "<maille.File: closed>"


def test_files_pickle(tmp_path, volume):
    (tmp_path / "v.maille").write_bytes(volume[1])
    for source in (str(tmp_path / "v.maille"), tmp_path / "v.maille", volume[1]):
        file = pickle.loads(pickle.dumps(maille.open(source, arrays=["p"])))
        assert list(file.box([0, 0, 0], [2, 2, 2]).cell_data) == ["p"]
    with pytest.raises(TypeError, match="can be pickled"):
        pickle.dumps(maille.open(io.BytesIO(volume[1])))


def test_damaged_pieces_are_named_or_left_out(volume):
    mesh, data = volume
    damaged = bytearray(data)
    damaged[len(data) // 2] ^= 255
    file = maille.open(bytes(damaged))
    with pytest.raises(maille.Error) as raised:
        file.extract()
    assert raised.value.code == maille.ErrorCode.CORRUPT
    assert 0 < file.extract(salvage=True).cell_count < mesh.cell_count


def test_a_stream_gives_all_cells_in_order(volume):
    mesh, _ = volume
    points = np.full((mesh.point_count, 3), np.nan, "f4")
    connectivity, p = [], []
    stream = maille.stream(maille.encode(mesh))
    assert [each.name for each in stream.arrays] == ["T", "v", "p", "id"]
    for portion in stream:
        points[portion.points] = portion.positions
        connectivity.append(portion.connectivity)
        p.append(portion.cell_data["p"])
        assert (portion.types == 12).all() and len(portion.offsets) == len(portion) + 1
    assert (points == mesh.points).all()
    assert (np.concatenate(connectivity).reshape(-1, 8) == mesh.cells[0].connectivity).all()
    assert (np.concatenate(p) == mesh.cell_data["p"]).all()


def test_slots_keep_a_table_small():
    n = 6
    layers = 60
    mesh = grid(n)
    points = np.vstack([mesh.points + [0, 0, n * k] for k in range(layers)]).astype("f4")
    cells = np.vstack([mesh.cells[0].connectivity.astype(int) + mesh.point_count * k for k in range(layers)])
    long = maille.Mesh(points, {"hexahedron": cells})
    table = np.zeros((0, 3))
    total = 0.0
    for portion in maille.stream(maille.encode(long)):
        if portion.slot_count > len(table):
            table = np.resize(table, (portion.slot_count, 3)) if len(table) else np.zeros((portion.slot_count, 3))
        table[portion.point_slots] = portion.positions
        total += table[portion.slots].sum()
    assert total == pytest.approx(points[cells].astype(float).sum())


def test_a_stream_of_all_kinds_and_of_steps(tmp_path):
    portions = list(maille.stream(maille.encode(all_kinds(), mode="stream")))
    assert sum(len(portion) for portion in portions) == 6
    assert [block[1] for portion in portions for block in portion.blocks] == ["corner", "", "both", "cell"]
    assert portions[-1].face_sizes.tolist() == [4] * 6
    path = tmp_path / "x.maille"
    maille.write(path, grid(3))
    maille.append(path, grid(3, cell_data={"p": np.full(27, 5, "f4")}), time=1)
    assert all((portion.cell_data["p"] == 5).all() for portion in maille.stream(path, step=1))
    with pytest.raises(maille.Error):
        maille.stream(maille.encode(sphere(4)))
    data = bytearray(maille.encode(grid(20)))
    data[len(data) // 2] ^= 1
    with pytest.raises(maille.Error):
        list(maille.stream(bytes(data)))


class Ranges(http.server.SimpleHTTPRequestHandler):
    """A server that knows ranges."""

    def log_message(self, *arguments):
        pass

    def do_GET(self):
        data = self.server.content
        begin, end = 0, len(data)
        wanted = self.headers.get("Range")
        if wanted:
            first, last = wanted.removeprefix("bytes=").split("-")
            begin, end = int(first), min(int(last) + 1 if last else len(data), len(data))
        self.send_response(206 if wanted else 200)
        self.send_header("ETag", '"one"')
        if wanted:
            self.send_header("Content-Range", f"bytes {begin}-{end - 1}/{len(data)}")
        self.send_header("Content-Length", str(end - begin))
        self.end_headers()
        self.wfile.write(data[begin:end])


@pytest.fixture
def served():
    server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), functools.partial(Ranges))
    thread = threading.Thread(target=server.serve_forever)
    thread.start()
    yield server
    server.shutdown()
    thread.join()
    server.server_close()


def test_parts_come_from_a_web_server(served):
    mesh = grid(40, cell_data={"noise": np.random.default_rng(1).random(64000)})
    served.content = maille.encode(mesh, pieces=2000, effort=1)
    address = f"http://127.0.0.1:{served.server_port}/flow.maille"
    with maille.open(address) as file:
        part = file.box([1, 1, 1], [3, 3, 3])
        assert part.cell_count >= 27 and file.fetched.bytes < len(served.content) / 2
        assert pickle.loads(pickle.dumps(file)).info.cells == 64000
    assert same(maille.read(address), mesh)


def test_a_file_that_changes_is_noticed(tmp_path, volume):
    path = tmp_path / "v.maille"
    path.write_bytes(volume[1])
    file = maille.open(path)
    file.box([0, 0, 0], [1, 1, 1])
    with open(path, "r+b") as other:
        other.truncate(2000)
    with pytest.raises((OSError, maille.Error)):
        file.extract()
