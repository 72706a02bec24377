#!/usr/bin/python3
"""vtkMailleReader and vtkMailleWriter against VTK's own readers of what the command writes.

MAILLE: the command; PYTHONPATH: where maillevtk is; MAILLE_DATA: the shared meshes."""
import os
import pathlib
import subprocess
import tempfile
import threading
import unittest

import numpy as np
from vtkmodules.util.numpy_support import vtk_to_numpy
from vtkmodules.vtkCommonCore import vtkStringArray, vtkCommand
from vtkmodules.vtkCommonDataModel import vtkPolyData, vtkUnstructuredGrid
from vtkmodules.vtkCommonExecutionModel import vtkStreamingDemandDrivenPipeline as Pipeline
from vtkmodules.vtkIOXML import vtkXMLPolyDataReader, vtkXMLUnstructuredGridReader, vtkXMLUnstructuredGridWriter

from maillevtk import vtkMailleReader, vtkMailleWriter

tool = os.environ['MAILLE']
data = pathlib.Path(os.environ.get('MAILLE_DATA', 'build/data'))
volumes = sorted(p for folder in ('hex', 'tet', 'mixed') for p in (data / folder).glob('*'))
surfaces = [data / p for p in ('poly/Torso.vtp', 'poly/lion_vase_poly.off', 'poly/office_chair.obj', 'textured/gargo.ply',
                               'textured/bunny10k_textured.ply', 'textured/spot.obj', 'tri/stanford-bunny.obj')]


def maille(*arguments):
    subprocess.run([tool, *map(str, arguments)], check=True, capture_output=True, text=True)


def watched(algorithm):
    """Errors and warnings of an algorithm go to a list instead of standard error."""
    said = []

    def take(caller, event, text):
        said.append(text)
    take.CallDataType = 'string0'
    algorithm.AddObserver(vtkCommand.ErrorEvent, take)
    algorithm.AddObserver(vtkCommand.WarningEvent, take)
    return said


def read(path, **properties):
    reader = vtkMailleReader()
    reader.SetFileName(str(path))
    for name, value in properties.items():
        getattr(reader, 'Set' + name)(value)
    reader.said = watched(reader)
    reader.Update()
    return reader


def arrays_of(attributes):
    found = {}
    for i in range(attributes.GetNumberOfArrays()):
        array = attributes.GetAbstractArray(i)
        if isinstance(array, vtkStringArray):
            found[array.GetName()] = [array.GetValue(k) for k in range(array.GetNumberOfValues())]
        else:
            found[array.GetName()] = vtk_to_numpy(array)
    return found


def cells_of(cells):
    return vtk_to_numpy(cells.GetOffsetsArray()), vtk_to_numpy(cells.GetConnectivityArray())


def polyhedra_of(grid):
    faces = grid.GetFaces()
    return (vtk_to_numpy(faces), vtk_to_numpy(grid.GetFaceLocations())) if faces else ()


def names_of_active(attributes):
    active = (attributes.GetNormals(), attributes.GetTCoords(), attributes.GetTangents())
    return [array.GetName() if array else None for array in active]


class Case(unittest.TestCase):
    def setUp(self):
        self.temporary = tempfile.TemporaryDirectory()
        self.folder = pathlib.Path(self.temporary.name)

    def tearDown(self):
        self.temporary.cleanup()

    def assert_bits(self, a, b, what):
        self.assertEqual(a.dtype.kind, b.dtype.kind, what)
        self.assertEqual(a.dtype.itemsize, b.dtype.itemsize, what)
        self.assertEqual(a.shape, b.shape, what)
        self.assertTrue(np.array_equal(np.ascontiguousarray(a).view(np.uint8), np.ascontiguousarray(b).view(np.uint8)), what)

    def assert_arrays(self, a, b, where):
        a, b = arrays_of(a), arrays_of(b)
        self.assertEqual(sorted(a), sorted(b), where)
        for name in a:
            if isinstance(a[name], list) and not isinstance(b[name], list):  # as VTU files of maille have texts of their own
                b[name] = b[name].tobytes().decode().split('\0')[:-1]
            if where == 'field array' and isinstance(a[name], list):
                # VTK's readers keep the last of several arrays of one name, as keys of metadata may be.
                self.assertEqual(a[name][-len(b[name]):], b[name], name)
            elif isinstance(a[name], list):
                self.assertEqual(a[name], b[name], f'{where} {name}')
            else:
                self.assert_bits(a[name], b[name], f'{where} {name}')

    def assert_same(self, a, b, field=True):
        """Bit for bit, up to the width of numbers of points."""
        self.assertEqual(a.GetClassName(), b.GetClassName())
        self.assertEqual(a.GetNumberOfPoints(), b.GetNumberOfPoints())
        if a.GetNumberOfPoints():
            self.assert_bits(vtk_to_numpy(a.GetPoints().GetData()), vtk_to_numpy(b.GetPoints().GetData()), 'points')
        if a.IsA('vtkPolyData'):
            lists = [('GetVerts',), ('GetLines',), ('GetPolys',), ('GetStrips',)]
        else:
            lists = [('GetCells',)]
            self.assertTrue(np.array_equal(vtk_to_numpy(a.GetCellTypesArray()), vtk_to_numpy(b.GetCellTypesArray())), 'types')
            for x, y in zip(polyhedra_of(a), polyhedra_of(b), strict=True):
                self.assertTrue(np.array_equal(x, y), 'polyhedra')
        for (name,) in lists:
            for x, y in zip(cells_of(getattr(a, name)()), cells_of(getattr(b, name)()), strict=True):
                self.assertTrue(np.array_equal(x, y), name)
        self.assert_arrays(a.GetPointData(), b.GetPointData(), 'point array')
        self.assert_arrays(a.GetCellData(), b.GetCellData(), 'cell array')
        self.assertEqual(names_of_active(a.GetPointData()), names_of_active(b.GetPointData()))
        if field:
            if a.IsA('vtkPolyData'):  # VTP has no sizes of blocks
                for name in ('maille_blocks', 'maille_block_names'):
                    a.GetFieldData().RemoveArray(name)
                    b.GetFieldData().RemoveArray(name)
            self.assert_arrays(a.GetFieldData(), b.GetFieldData(), 'field array')

    def as_vtk_reads(self, path, reader, *options):
        maille('decompress', '-q', '-f', *options, self.folder / 'in.maille', path)
        reader.SetFileName(str(path))
        reader.Update()
        return reader.GetOutput()

    def make(self, mesh, *options):
        maille('compress', '-q', '-f', *options, mesh, self.folder / 'in.maille')
        return self.folder / 'in.maille'


class Volumes(Case):
    def test_each_shared_volume_is_what_vtk_reads_of_the_command_s_vtu(self):
        for path in volumes:
            with self.subTest(path.name):
                file = self.make(path, '--mode', 'stream')
                ours = read(file)
                times = ours.GetOutputInformation(0).Get(Pipeline.TIME_STEPS())
                of_time = ['--time', repr(times[0])] if times else []
                theirs = self.as_vtk_reads(self.folder / 'out.vtu', vtkXMLUnstructuredGridReader(), *of_time)
                self.assertEqual(ours.said, [])
                self.assertEqual(ours.GetErrorCode(), 0)
                output = ours.GetOutputDataObject(0)
                if output.IsA('vtkPolyData'):  # flat ones
                    theirs = self.as_vtk_reads(self.folder / 'out.vtp', vtkXMLPolyDataReader(), *of_time)
                self.assert_same(output, theirs)

    def test_each_shared_volume_comes_back_from_the_writer(self):
        for path in volumes:
            with self.subTest(path.name):
                self.make(path, '--mode', 'stream')
                before = read(self.folder / 'in.maille')
                for mode in (vtkMailleWriter.AUTOMATIC, vtkMailleWriter.STREAM):
                    writer = vtkMailleWriter()
                    writer.SetMode(mode)
                    writer.SetInputConnection(before.GetOutputPort())
                    writer.SetFileName(str(self.folder / 'again.maille'))
                    said = watched(writer)
                    self.assertEqual(writer.Write(), 1, said)
                    after = read(self.folder / 'again.maille')
                    self.assert_same(before.GetOutputDataObject(0), after.GetOutputDataObject(0))

    def test_pieces_have_all_cells_once(self):
        file = self.make(data / 'tet/syrthes_plates3d.mesh', '--pieces', '10000')
        whole = read(file).GetOutputDataObject(0)
        for count in (2, 3, 5):
            cells, volume = 0, 0
            for piece in range(count):
                reader = vtkMailleReader()
                reader.SetFileName(str(file))
                reader.UpdatePiece(piece, count, 0)
                part = reader.GetOutputDataObject(0)
                self.assertTrue(part.IsA('vtkUnstructuredGrid'))
                self.assertGreater(part.GetNumberOfCells(), 0)
                cells += part.GetNumberOfCells()
            self.assertEqual(cells, whole.GetNumberOfCells())

    def test_one_piece_is_read_by_one_process(self):
        file = self.make(data / 'hex/can.vtu', '--mode', 'stream')
        counts = []
        for piece in range(3):
            reader = vtkMailleReader()
            reader.SetFileName(str(file))
            reader.UpdatePiece(piece, 3, 0)
            counts.append(reader.GetOutputDataObject(0).GetNumberOfCells())
        self.assertEqual(sorted(counts), [0, 0, 4800])

    def test_a_region_has_the_cells_that_meet_it(self):
        for options in (['--pieces', '1000'], []):
            file = self.make(data / 'hex/can.vtu', '--mode', 'stream', *options)
            whole = read(file).GetOutputDataObject(0)
            low, high = np.array(whole.GetBounds()).reshape(3, 2).T
            box = np.column_stack([low, (low + high) / 2])
            part = read(file, UseRegion=True, Region=box.ravel().tolist()).GetOutputDataObject(0)
            offsets, connectivity = cells_of(whole.GetCells())
            corners = vtk_to_numpy(whole.GetPoints().GetData())[connectivity].reshape(-1, 8, 3)
            meet = np.all((corners.min(axis=1) <= box[:, 1]) & (corners.max(axis=1) >= box[:, 0]), axis=1)
            self.assertEqual(part.GetNumberOfCells(), meet.sum())

    def test_blocks_are_named_parts_of_a_collection(self):
        file = self.make(data / 'mixed/mesh_brick_pyra_ffd.su2', '--mode', 'stream')
        whole = read(file).GetOutputDataObject(0)
        names = arrays_of(whole.GetFieldData())['maille_block_names']
        sizes = arrays_of(whole.GetFieldData())['maille_blocks'][:, 0]
        parts = read(file, Blocks=True).GetOutputDataObject(0)
        self.assertTrue(parts.IsA('vtkPartitionedDataSetCollection'))
        self.assertEqual(parts.GetNumberOfPartitionedDataSets(), len(names))
        for i, name in enumerate(names):
            part = parts.GetPartitionAsDataObject(i, 0)
            self.assertEqual(part.GetNumberOfCells(), sizes[i])
            self.assertEqual(parts.GetMetaData(i).Get(parts.NAME()), name or f'block {i}')

    def test_arrays_are_selected_each_in_its_domain(self):
        file = self.make(data / 'hex/can.vtu', '--mode', 'stream')
        reader = vtkMailleReader()
        reader.SetFileName(str(file))
        reader.UpdateInformation()
        names = {reader.GetPointArrayName(i) for i in range(reader.GetNumberOfPointArrays())}
        self.assertIn('DISPL', names)
        self.assertEqual(reader.GetCellArrayName(0), 'EQPS')
        reader.GetPointArraySelection().DisableAllArrays()
        reader.SetPointArrayStatus('VEL', 1)
        reader.Update()
        output = reader.GetOutputDataObject(0)
        self.assertEqual(sorted(arrays_of(output.GetPointData())), ['VEL'])
        self.assertEqual(sorted(arrays_of(output.GetCellData())), ['EQPS'])
        reader.SetPointArrayStatus('DISPL', 1)  # is a change
        reader.Update()
        self.assertEqual(sorted(arrays_of(reader.GetOutputDataObject(0).GetPointData())), ['DISPL', 'VEL'])


class Times(Case):
    def series(self, count=4):
        """A grid whose values change, as a pipeline."""
        from vtkmodules.util.vtkAlgorithm import VTKPythonAlgorithmBase
        from vtkmodules.util.numpy_support import numpy_to_vtk
        self.make(data / 'hex/mug.e', '--mode', 'stream')
        grid = vtkUnstructuredGrid()
        grid.DeepCopy(read(self.folder / 'in.maille').GetOutputDataObject(0))

        class Source(VTKPythonAlgorithmBase):
            def __init__(self):
                super().__init__(nInputPorts=0, nOutputPorts=1, outputType='vtkUnstructuredGrid')

            def RequestInformation(self, request, inputs, outputs):
                times = [0.5 * i for i in range(count)]
                outputs.GetInformationObject(0).Set(Pipeline.TIME_STEPS(), times, count)
                outputs.GetInformationObject(0).Set(Pipeline.TIME_RANGE(), [times[0], times[-1]], 2)
                return 1

            def RequestData(self, request, inputs, outputs):
                information = outputs.GetInformationObject(0)
                time = information.Get(Pipeline.UPDATE_TIME_STEP()) if information.Has(Pipeline.UPDATE_TIME_STEP()) else 0
                output = vtkUnstructuredGrid.GetData(information)
                output.ShallowCopy(grid)
                values = numpy_to_vtk(np.linspace(time, time + 1, grid.GetNumberOfPoints()), deep=True)
                values.SetName('t')
                output.GetPointData().AddArray(values)
                output.GetInformation().Set(output.DATA_TIME_STEP(), time)
                return 1
        return Source()

    def test_all_times_go_round(self):
        writer = vtkMailleWriter()
        source = self.series()
        writer.SetInputConnection(source.GetOutputPort())
        writer.SetFileName(str(self.folder / 'run.maille'))
        writer.WriteAllTimeStepsOn()
        said = watched(writer)
        self.assertEqual(writer.Write(), 1, said)
        reader = vtkMailleReader()
        reader.SetFileName(str(self.folder / 'run.maille'))
        reader.UpdateInformation()
        times = list(reader.GetOutputInformation(0).Get(Pipeline.TIME_STEPS()))
        self.assertEqual(times, [0, 0.5, 1, 1.5])
        for time in (1.0, 0.0, 1.5, 0.5, 0.7):
            reader.UpdateTimeStep(time)
            output = reader.GetOutputDataObject(0)
            known = np.floor(time * 2) / 2
            values = np.linspace(known, known + 1, output.GetNumberOfPoints())
            self.assert_bits(arrays_of(output.GetPointData())['t'], values, time)
            self.assertEqual(output.GetInformation().Get(output.DATA_TIME_STEP()), time)
        self.assertEqual([p.name for p in self.folder.glob('*.part')], [])

    def test_one_time_keeps_its_time(self):
        source = self.series()
        source.UpdateTimeStep(1.0)
        writer = vtkMailleWriter()
        writer.SetInputDataObject(source.GetOutputDataObject(0))
        writer.SetFileName(str(self.folder / 'one.maille'))
        self.assertEqual(writer.Write(), 1)
        reader = read(self.folder / 'one.maille')
        self.assertEqual(list(reader.GetOutputInformation(0).Get(Pipeline.TIME_STEPS())), [1.0])


class Surfaces(Case):
    def test_each_surface_is_what_vtk_reads_of_the_command_s_vtp(self):
        for path in surfaces:
            for mode in ('single', 'random'):
                with self.subTest(path.name, mode=mode):
                    file = self.make(path, '--mode', mode)
                    ours = read(file)
                    theirs = self.as_vtk_reads(self.folder / 'out.vtp', vtkXMLPolyDataReader())
                    self.assertEqual(ours.said, [])
                    self.assert_same(ours.GetOutputDataObject(0), theirs)

    def test_surfaces_come_back_from_the_writer(self):
        for path in surfaces:
            with self.subTest(path.name):
                before = read(self.make(path, '--mode', 'single'))
                writer = vtkMailleWriter()
                writer.SetInputConnection(before.GetOutputPort())
                writer.SetFileName(str(self.folder / 'again.maille'))
                watched(writer)
                self.assertEqual(writer.Write(), 1)
                self.assert_same(before.GetOutputDataObject(0), read(self.folder / 'again.maille').GetOutputDataObject(0))

    def test_levels_and_errors_and_pieces_of_mode_random(self):
        file = self.make(data / 'tri/stanford-bunny.obj', '--mode', 'random')
        whole = read(file).GetOutputDataObject(0)
        reader = read(file)
        self.assertGreater(reader.GetNumberOfLevels(), 2)
        faces = [read(file, Level=level).GetOutputDataObject(0).GetNumberOfCells() for level in range(3)]
        self.assertEqual(faces[0], whole.GetNumberOfCells())
        self.assertLess(faces[1], 0.4 * faces[0])
        self.assertLess(faces[2], 0.4 * faces[1])
        coarse = read(file, MaximumError=0.002).GetOutputDataObject(0).GetNumberOfCells()
        self.assertLess(coarse, faces[0])
        for level in (0, 1):
            cells = 0
            for piece in range(3):
                reader = vtkMailleReader()
                reader.SetFileName(str(file))
                reader.SetLevel(level)
                reader.UpdatePiece(piece, 3, 0)
                cells += reader.GetOutputDataObject(0).GetNumberOfCells()
            self.assertEqual(cells, faces[level])

    def test_a_view_refines_what_is_near(self):
        file = self.make(data / 'tri/stanford-bunny.obj', '--mode', 'random')
        whole = read(file).GetOutputDataObject(0)
        low, high = np.array(whole.GetBounds())[0::2], np.array(whole.GetBounds())[1::2]

        def seen(eye, **more):
            return read(file, UseView=True, Eye=list(eye), **more).GetOutputDataObject(0)
        far, near = seen(high + 100 * (high - low), Pixels=8), seen(high, Pixels=8)
        self.assertTrue(0 < far.GetNumberOfCells() < near.GetNumberOfCells() < whole.GetNumberOfCells())
        self.assertEqual(seen(high, Pixels=0).GetNumberOfCells(), whole.GetNumberOfCells())

        def on_the_right(eye):
            points = vtk_to_numpy(seen(eye, Pixels=8).GetPoints().GetData())
            return (points[:, 0] > (low + high)[0] / 2).mean()
        middle, step = (low + high) / 2, np.array([0.6 * (high - low)[0], 0, 0])
        self.assertGreater(on_the_right(middle + step), on_the_right(middle - step))

    def test_a_region_of_a_surface_is_a_part_of_it(self):
        for mode in ('random', 'single'):
            file = self.make(data / 'tri/stanford-bunny.obj', '--mode', mode)
            whole = read(file).GetOutputDataObject(0)
            b = whole.GetBounds()
            box = [b[0], (b[0] + b[1]) / 2, *b[2:]]
            part = read(file, UseRegion=True, Region=box).GetOutputDataObject(0)
            x = vtk_to_numpy(whole.GetPoints().GetData())[:, 0]
            offsets, connectivity = cells_of(whole.GetPolys())
            expected = np.any(x[connectivity].reshape(-1, 3) <= np.float32(box[1]), axis=1).sum()
            self.assertEqual(part.GetNumberOfCells(), expected)


class Bounds(Case):
    def test_an_error_bound_is_kept_and_makes_a_smaller_file(self):
        before = read(self.make(data / 'hex/can.vtu', '--mode', 'stream')).GetOutputDataObject(0)
        writer = vtkMailleWriter()
        writer.SetInputDataObject(before)
        writer.SetFileName(str(self.folder / 'lossy.maille'))
        writer.SetErrorBound('', 1e-3)
        writer.SetErrorBound('VEL', 2.0)
        writer.SetTolerance('ACCL', vtkMailleWriter.RELATIVE, 1e-3)
        self.assertEqual(writer.Write(), 1)
        after = read(self.folder / 'lossy.maille').GetOutputDataObject(0)
        x, y = (vtk_to_numpy(d.GetPoints().GetData()).astype(float) for d in (before, after))
        self.assertLessEqual(np.abs(x - y).max(), 1e-3)
        a, b = arrays_of(before.GetPointData()), arrays_of(after.GetPointData())
        self.assertLessEqual(np.abs(a['VEL'].astype(float) - b['VEL']).max(), 2)
        self.assertGreater(np.abs(a['VEL'].astype(float) - b['VEL']).max(), 0)
        self.assert_bits(a['DISPL'], b['DISPL'], 'DISPL')
        self.assertLess((self.folder / 'lossy.maille').stat().st_size, (self.folder / 'in.maille').stat().st_size)

    def test_a_bound_of_no_array_is_an_error_and_leaves_no_file(self):
        before = read(self.make(data / 'hex/can.vtu', '--mode', 'stream')).GetOutputDataObject(0)
        writer = vtkMailleWriter()
        writer.SetInputDataObject(before)
        writer.SetFileName(str(self.folder / 'none.maille'))
        writer.SetErrorBound('pressure', 1)
        said = watched(writer)
        self.assertEqual(writer.Write(), 0)
        self.assertIn('pressure', said[0])
        self.assertFalse((self.folder / 'none.maille').exists())


class Trouble(Case):
    def test_damaged_files_give_a_message_and_an_empty_output(self):
        file = self.make(data / 'hex/can.vtu', '--mode', 'stream')
        whole = file.read_bytes()
        damaged = self.folder / 'damaged.maille'
        for name, content in {'cut': whole[:len(whole) // 2], 'front': b'x' + whole[1:], 'empty': b'',
                              'flipped': whole[:20000] + bytes([whole[20000] ^ 255]) + whole[20001:]}.items():
            with self.subTest(name):
                damaged.write_bytes(content)
                reader = read(damaged)
                self.assertTrue(reader.said)
                self.assertIn('damaged.maille', reader.said[0])
                self.assertNotEqual(reader.GetErrorCode(), 0)
                self.assertEqual(reader.GetOutputDataObject(0).GetNumberOfPoints(), 0)
        damaged.write_bytes(whole)  # mended
        reader.Modified()
        reader.Update()
        self.assertEqual(reader.GetOutputDataObject(0).GetNumberOfCells(), 4800)

    def test_a_missing_file_and_no_name_are_told(self):
        self.assertIn('none.maille', read(self.folder / 'none.maille').said[0])
        reader = vtkMailleReader()
        said = watched(reader)
        reader.Update()
        self.assertIn('SetFileName', said[0])

    def test_files_are_known_by_their_first_bytes(self):
        reader = vtkMailleReader()
        self.assertEqual(reader.CanReadFile(str(self.make(data / 'hex/can.vtu'))), 1)
        self.assertEqual(reader.CanReadFile(str(data / 'hex/can.vtu')), 0)
        self.assertEqual(reader.CanReadFile('nowhere.maille'), 0)

    def test_progress_comes_on_the_calling_thread_and_abort_ends_it(self):
        file = self.make(data / 'hex/voxel_ct_cranium_bone.vtu', '--mode', 'stream')
        threads, seen = set(), []
        reader = vtkMailleReader()
        reader.SetFileName(str(file))

        def progress(caller, event):
            threads.add(threading.get_ident())
            seen.append(caller.GetProgress())
        reader.AddObserver(vtkCommand.ProgressEvent, progress)
        reader.Update()
        self.assertEqual(threads, {threading.get_ident()})
        self.assertGreater(len(set(seen)), 3)
        self.assertEqual(reader.GetOutputDataObject(0).GetNumberOfCells(), 475759)
        reader.AddObserver(vtkCommand.ProgressEvent, lambda caller, event: caller.SetAbortExecute(True))
        reader.Modified()
        reader.Update()
        self.assertEqual(reader.GetOutputDataObject(0).GetNumberOfCells(), 0)

    def test_a_data_set_of_any_kind_can_be_written(self):
        from vtkmodules.vtkImagingCore import vtkRTAnalyticSource
        source = vtkRTAnalyticSource()
        source.SetWholeExtent(0, 5, 0, 6, 0, 7)
        writer = vtkMailleWriter()
        writer.SetInputConnection(source.GetOutputPort())
        writer.SetFileName(str(self.folder / 'image.maille'))
        self.assertEqual(writer.Write(), 1)
        output = read(self.folder / 'image.maille').GetOutputDataObject(0)
        self.assertEqual(output.GetNumberOfCells(), 5 * 6 * 7)
        self.assertEqual(output.GetBounds(), (0, 5, 0, 6, 0, 7))
        self.assert_bits(arrays_of(output.GetPointData())['RTData'],
                         vtk_to_numpy(source.GetOutput().GetPointData().GetArray('RTData')), 'RTData')


class Addresses(Case):
    def test_a_file_on_a_server_reads_as_one_on_disk(self):
        file = self.make(data / 'tri/stanford-bunny.obj', '--mode', 'random')
        server = subprocess.Popen([tool, 'serve', '--port', '0', str(self.folder)], stdout=subprocess.PIPE,
                                  stderr=subprocess.DEVNULL, text=True)
        try:
            address = server.stdout.readline().strip().rstrip('/') + '/in.maille'
            for level in (0, 1):
                here = read(file, Level=level)
                there = read(address, Level=level)
                self.assertEqual(there.said, [])
                self.assert_same(here.GetOutputDataObject(0), there.GetOutputDataObject(0))
        finally:
            server.terminate()
            server.wait()
            server.stdout.close()


if __name__ == '__main__':
    unittest.main(verbosity=2)
