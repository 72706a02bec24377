#!/usr/bin/env python3
"""Writes the files of HDF5 beside it: VTKHDF as VTK's specification has it, by h5py (Debian: python3-h5py), and an
Exodus file in netCDF-4 by nccopy (netcdf-bin); CGNS as other versions than that of make_cgns.c have it. Needed only to change them; dates are left out, so bytes stay."""
import subprocess
import xml.etree.ElementTree as xml
from pathlib import Path

import h5py
import numpy as np

here = Path(__file__).parent
types = {'Float32': 'f4', 'Float64': 'f8', 'Int32': 'i4', 'Int64': 'i8', 'UInt8': 'u1'}


def arrays(element):
    """Name to values, of a VTU file in text."""
    found = {}
    for node in element if element is not None else ():
        values = np.array((node.text or '').split(), dtype=types[node.get('type')])
        width = int(node.get('NumberOfComponents', 1))
        found[node.get('Name')] = values.reshape(-1, width) if width > 1 else values
    return found


def faces_of(cells, count):
    """VTK's stream of faces as the lists of VTKHDF: points, their offsets, faces of cells, their offsets."""
    if 'faces' not in cells:
        return None
    points, offsets, cell_offsets, at = [], [0], [0], 0
    for cell in range(count):
        if cells['faceoffsets'][cell] >= 0:
            faces, at = cells['faces'][at], at + 1
            for _ in range(faces):
                size = cells['faces'][at]
                points += list(cells['faces'][at + 1:at + 1 + size])
                offsets.append(len(points))
                at += 1 + size
        cell_offsets.append(len(offsets) - 1)
    return points, offsets, list(range(len(offsets) - 1)), cell_offsets


def part_of(path):
    piece = xml.parse(here / path).getroot().find('UnstructuredGrid/Piece')
    cells = arrays(piece.find('Cells'))
    count = len(cells['types'])
    return {'points': arrays(piece.find('Points'))['Points'], 'connectivity': cells['connectivity'],
            'offsets': np.concatenate(([0], cells['offsets'])), 'types': cells['types'], 'faces': faces_of(cells, count),
            'PointData': arrays(piece.find('PointData')), 'CellData': arrays(piece.find('CellData'))}


def begin(name, kind, version=(2, 2), **more):
    file = h5py.File(here / name, 'w', **more)
    root = file.create_group('VTKHDF')
    root.attrs['Version'] = version
    root.attrs.create('Type', kind.encode(), dtype=h5py.string_dtype('ascii', len(kind)))
    return file, root


def join(lists, dtype='i8'):
    return np.concatenate([np.asarray(values, dtype=dtype) for values in lists])


def put_data(root, parts):
    for group in ('PointData', 'CellData'):
        root.create_group(group)
        for array in parts[0][group]:
            root[group][array] = np.concatenate([part[group][array] for part in parts])


def write_grid(name, parts, version=(2, 2), packed={}, **more):
    file, root = begin(name, 'UnstructuredGrid', version, **more)
    put = lambda key, values: root.create_dataset(key, data=values, **packed)
    put('NumberOfPoints', np.array([len(part['points']) for part in parts]))
    put('NumberOfCells', np.array([len(part['types']) for part in parts]))
    put('NumberOfConnectivityIds', np.array([len(part['connectivity']) for part in parts]))
    put('Points', np.concatenate([part['points'] for part in parts]))
    put('Connectivity', join([part['connectivity'] for part in parts]))
    put('Offsets', join([part['offsets'] for part in parts]))
    put('Types', join([part['types'] for part in parts], 'u1'))
    if parts[0].get('faces'):
        faces = [part['faces'] for part in parts]
        put('NumberOfFaces', np.array([len(each[1]) - 1 for each in faces]))
        put('NumberOfFaceConnectivityIds', np.array([len(each[0]) for each in faces]))
        put('NumberOfPolyhedronToFaceIds', np.array([len(each[2]) for each in faces]))
        for i, key in enumerate(('FaceConnectivity', 'FaceOffsets', 'PolyhedronToFaces', 'PolyhedronOffsets')):
            put(key, join([each[i] for each in faces]))
    put_data(root, parts)
    return file, root


def bar_part(first, end, length, field=lambda x: x):
    """Cells first to end of a bar of unit cubes, with a ghost at either side."""
    cells = range(max(first - 1, 0), min(end + 1, length))
    ids = np.arange(4 * cells[0], 4 * (cells[-1] + 2))
    at = np.stack([ids // 4, ids % 2, ids // 2 % 2], axis=1).astype('f4')
    corner = lambda x: [4 * (x - cells[0]) + i for i in (0, 4, 5, 1, 2, 6, 7, 3)]
    return {'points': at, 'connectivity': np.array([i for x in cells for i in corner(x)]),
            'offsets': 8 * np.arange(len(cells) + 1), 'types': np.full(len(cells), 12),
            'PointData': {'GlobalPointIds': ids, 'T': field(at[:, 0].astype('f8'))},
            'CellData': {'GlobalCellIds': np.array(cells), 'owner': np.full(len(cells), first, 'i4'),
                         'vtkGhostType': np.array([int(not first <= x < end) for x in cells], 'u1')}}


def steps(root, values, **offsets):
    group = root.create_group('Steps')
    group.attrs['NSteps'] = len(values)
    group['Values'] = np.array(values, 'f8')
    for key, rows in offsets.items():
        group[key.replace('__', '/')] = np.array(rows, 'i8')


def corrupt():
    """Files of tests/corrupt/io whose HDF5 is as it should be, but not what it says."""
    def grid(name, change):
        file, root = write_grid(f'../corrupt/io/vtkhdf_{name}.vtkhdf', [bar_part(0, 2, 4), bar_part(2, 4, 4)], libver='latest')
        del root['PointData'], root['CellData']
        change(root)
        file.close()

    def replace(key, values, **more):
        def change(root):
            del root[key]
            root.create_dataset(key, data=values, **more)
        return change

    def never_written(root):
        del root['Points']
        root.create_dataset('Points', (1 << 30, 3), 'f4', chunks=(1024, 3))
        root['NumberOfPoints'][...] = [1 << 29, 1 << 29]

    def elsewhere(root):
        del root['Types']
        root.create_dataset('Types', (6,), 'u1', external=[('/etc/passwd', 0, 6)])

    def link(root):
        del root['Types']
        root['Types'] = h5py.ExternalLink('ghosts.vtkhdf', '/VTKHDF/Types')

    def step(parts, point=0):
        return lambda root: steps(root, [0], PartOffsets=[1], NumberOfParts=[parts], PointOffsets=[point])

    def field(root):
        root['CellData/heat'] = np.zeros(5)

    grid('counts_beyond_the_points', lambda root: root['NumberOfPoints'].__setitem__(0, 1000))
    grid('count_below_zero', lambda root: root['NumberOfCells'].__setitem__(1, -3))
    grid('counts_of_too_few_parts', replace('NumberOfCells', [3]))
    grid('offsets_that_fall', lambda root: root['Offsets'].__setitem__(2, 4))
    grid('offsets_not_from_zero', lambda root: root['Offsets'].__setitem__(4, 24))
    grid('point_of_another_part', lambda root: root['Connectivity'].__setitem__(3, 16))
    grid('points_never_written', never_written)
    grid('values_in_another_file', elsewhere)
    grid('link_to_another_file', link)
    grid('step_of_parts_that_are_not_there', step(2))
    grid('step_of_points_that_are_not_there', step(1, 40))
    grid('array_with_too_few_values', field)
    grid('of_images', lambda root: root.attrs.__setitem__('Type', 'ImageData'))


def main():
    write_grid('pieces.vtkhdf', [part_of('pieces_0.vtu'), part_of('pieces_1.vtu')], (1, 0))
    write_grid('polyhedra.vtkhdf', [part_of('polyhedra.vtu')], (2, 5),
               dict(chunks=True, compression='gzip', shuffle=True), libver='latest')
    write_grid('ghosts.vtkhdf', [bar_part(0, 2, 6), bar_part(2, 4, 6), bar_part(4, 6, 6)])

    # One mesh, three times: a field that changes, one that does not, a number of the mesh.
    times = [0, 0.5, 2]
    grids = [[bar_part(0, 2, 4, lambda x: x + time), bar_part(2, 4, 4, lambda x: x + time)] for time in times]
    file, root = write_grid('steps.hdf', grids[0])
    del root['PointData/T']
    root['PointData/T'] = np.concatenate([part['PointData']['T'] for parts in grids for part in parts])
    rows = sum(len(part['points']) for part in grids[0])
    root['FieldData/energy'] = np.array([[10.0], [20.0], [30.0]])
    none = [0] * len(times)
    steps(root, times, PartOffsets=none, NumberOfParts=[2] * 3, PointOffsets=none, CellOffsets=[[0]] * 3,
          ConnectivityIdOffsets=[[0]] * 3, PointDataOffsets__T=[0, rows, 2 * rows],
          PointDataOffsets__GlobalPointIds=none, CellDataOffsets__owner=none, CellDataOffsets__vtkGhostType=none,
          CellDataOffsets__GlobalCellIds=none)

    # Another mesh at each time, in another number of parts.
    moving = [[bar_part(0, 2, 3), bar_part(2, 3, 3)], [bar_part(0, 5, 5)]]
    file, root = write_grid('moving.vtkhdf', moving[0] + moving[1])
    before = {key: sum(len(part[key]) for part in moving[0]) for key in ('points', 'types', 'connectivity')}
    steps(root, [1, 2], PartOffsets=[0, 2], NumberOfParts=[2, 1], PointOffsets=[0, before['points']],
          CellOffsets=[0, before['types']], ConnectivityIdOffsets=[0, before['connectivity']])

    # Poly data in two parts: a vertex, a line, polygons; one square, then a pentagon and a triangle.
    file, root = begin('surface.vtkhdf', 'PolyData')
    root['NumberOfPoints'] = [4, 6]
    root['Points'] = np.array([[x, y, part] for part, ring in enumerate(
        ([(0, 0), (1, 0), (1, 1), (0, 1)], [(0, 0), (1, 0), (2, 1), (1, 2), (0, 1), (3, 3)])) for x, y in ring], 'f4')
    kinds = {'Vertices': [[[3]], []], 'Lines': [[[0, 2]], [[0, 1, 5]]], 'Polygons': [[[0, 1, 2, 3]], [[0, 1, 2, 3, 4], [2, 5, 3]]],
             'Strips': [[], []]}
    for kind, parts in kinds.items():
        group = root.create_group(kind)
        group['NumberOfCells'] = [len(part) for part in parts]
        group['NumberOfConnectivityIds'] = [sum(map(len, part)) for part in parts]
        group['Connectivity'] = join([join(part) if part else [] for part in parts])
        group['Offsets'] = join([np.cumsum([0] + [len(cell) for cell in part]) for part in parts])
    root.create_dataset('PointData/n', data=np.tile(np.array([0, 0, 1], 'f4'), (10, 1)))
    root['PointData'].attrs.create('Normals', b'n', dtype=h5py.string_dtype('ascii', 1))
    root['CellData/number'] = np.arange(6, dtype='i4')

    subprocess.run(['nccopy', '-k', 'nc4', 'small.e', 'small_netcdf4.e'], cwd=here, check=True)
    subprocess.run(['nccopy', '-k', 'nc4', '-d', '1', 'table_of_variables.e', 'table_netcdf4.e'], cwd=here, check=True)


def node(parent, name, label, values=None, **more):
    """A node of CGNS: a group whose value is the dataset " data", the first direction fastest."""
    group = parent.create_group(name)
    if isinstance(values, str):
        values = np.frombuffer(values.encode(), 'i1')
    kind = 'MT' if values is None else {'i1': 'C1', 'i4': 'I4', 'i8': 'I8', 'f4': 'R4', 'f8': 'R8'}[values.dtype.str[1:]]
    for key, text in (('name', name), ('label', label), ('type', kind)):
        group.attrs[key] = np.bytes_(text.ljust(33 if key != 'type' else 3, '\0'))
    if values is not None:
        group.create_dataset(' data', data=values, **more)
    return group


def two_cubes(name, change=lambda zone: None):
    """Two polyhedra side by side, as versions before 3.4 have them: with the length of each list before it."""
    file = h5py.File(here / f'{name}.cgns', 'w', libver='latest')
    base = node(file, 'Base', 'CGNSBase_t', np.array([3, 3], 'i4'))
    zone = node(base, 'two', 'Zone_t', np.array([[12], [2], [0]], 'i8'))
    node(zone, 'ZoneType', 'ZoneType_t', 'Unstructured')
    grid = node(zone, 'GridCoordinates', 'GridCoordinates_t')
    at = np.arange(12)
    for axis, values in zip('XYZ', (at % 3, at // 3 % 2, at // 6)):
        node(grid, 'Coordinate' + axis, 'DataArray_t', values.astype('f8'))
    faces = [[1, 7, 10, 4], [1, 4, 5, 2], [7, 8, 11, 10], [1, 2, 8, 7], [4, 10, 11, 5], [2, 5, 11, 8], [2, 5, 6, 3],
             [8, 9, 12, 11], [2, 3, 9, 8], [5, 11, 12, 6], [3, 6, 12, 9]]
    cells = [[1, 2, 3, 4, 5, 6], [-6, 7, 8, 9, 10, 11]]
    for key, kind, first, lists in (('cells', 23, 12, cells), ('faces', 22, 1, faces)):
        section = node(zone, key, 'Elements_t', np.array([kind, 0], 'i4'))
        node(section, 'ElementRange', 'IndexRange_t', np.array([first, first + len(lists) - 1], 'i8'))
        node(section, 'ElementConnectivity', 'DataArray_t', np.array(sum(([len(x)] + x for x in lists), []), 'i8'))
    flow = node(zone, 'Flow', 'FlowSolution_t')
    node(flow, 'GridLocation', 'GridLocation_t', 'CellCenter')
    node(flow, 'Density', 'DataArray_t', np.array([1, 2], 'f4'))
    conditions = node(zone, 'ZoneBC', 'ZoneBC_t')
    for key, first, last in (('inlet', 1, 1), ('wall', 7, 11)):
        condition = node(conditions, key, 'BC_t', 'BC' + key.title())
        node(condition, 'PointRange', 'IndexRange_t', np.array([[first, last]], 'i8'))
        node(condition, 'GridLocation', 'GridLocation_t', 'FaceCenter')
    change(zone)
    file.close()


def corrupt_cgns():
    def cubes(name, change):
        two_cubes(f'../corrupt/io/cgns_{name}', change)

    def replace(path, values, **more):
        def change(zone):
            del zone[path + '/ data']
            zone[path].create_dataset(' data', data=None if 'shape' in more else np.array(values), **more)
        return change

    def link(zone):
        del zone['GridCoordinates']
        other = node(zone, 'GridCoordinates', 'GridCoordinates_t')
        other.attrs['type'] = np.bytes_('LK\0')
        other[' link'] = h5py.ExternalLink('/etc/passwd', '/Base')

    def rind(zone):
        node(zone['Flow'], 'Rind', 'Rind_t', np.array([-1, 1], 'i4'))

    def structured(zone):
        replace('ZoneType', np.frombuffer(b'Structured', 'i1'))(zone)
        replace('.', [[1 << 20, 1 << 20, 1], [3, 2, 1], [0, 0, 0]])(zone)

    cubes('range_beyond_the_elements', replace('faces/ElementRange', [1, 1 << 40]))
    cubes('list_beyond_the_end', replace('cells/ElementConnectivity', [6, 1, 2, 3, 4, 5, 6, 1 << 62, -6, 7, 8, 9]))
    cubes('face_that_is_not_there', replace('cells/ElementConnectivity', [1, 1, 1, 12]))
    cubes('point_that_is_not_there', replace('faces/ElementConnectivity', [4, 1, 7, 13, 4] * 11))
    cubes('elements_of_third_order', replace('faces', [30, 0]))
    cubes('condition_that_is_not_there', replace('ZoneBC/inlet/PointRange', [[1, 1 << 62]]))
    cubes('coordinates_never_written', replace('GridCoordinates/CoordinateX', 0, shape=(12 << 16,), dtype='f8', chunks=(1024,)))
    cubes('link_to_another_file', link)
    cubes('planes_of_ghosts_below_zero', rind)
    cubes('sizes_beyond_all_points', structured)
    (here / '../corrupt/io/cgns_in_adf.cgns').write_bytes(b'@(#)ADF Database Version A02011>' + bytes(64))


main()
corrupt()
two_cubes('polyhedra_33')
corrupt_cgns()
