#!/usr/bin/python3
"""Processor time of vtkMailleReader beside vtkXMLUnstructuredGridReader (zlib) on the shared volumes, as a table.

MAILLE, MAILLE_DATA, PYTHONPATH: as test_reader.py has them. Arguments: options of `maille compress`."""
import os
import pathlib
import subprocess
import sys
import tempfile
import time

from vtkmodules.vtkCommonDataModel import vtkUnstructuredGrid
from vtkmodules.vtkIOXML import vtkXMLUnstructuredGridReader, vtkXMLUnstructuredGridWriter

from maillevtk import vtkMailleReader

data = pathlib.Path(os.environ.get('MAILLE_DATA', 'build/data'))


def seconds(make):
    """The least of some runs: of processor time, all threads together, as other programs run beside this one."""
    times, spent = [], 0
    while len(times) < 3 or (spent < 1 and len(times) < 20):
        reader = make()
        begin = time.process_time()
        reader.Update()
        times.append(time.process_time() - begin)
        spent += times[-1]
    return min(times), reader


def maille_reader(path, threads=1):
    reader = vtkMailleReader()
    reader.SetFileName(str(path))
    reader.SetNumberOfThreads(threads)
    return reader


def vtu_reader(path):
    reader = vtkXMLUnstructuredGridReader()
    reader.SetFileName(str(path))
    return reader


print('| volume | cells | VTU, bytes | .maille, bytes | VTU, ms | .maille, ms | times as fast |')
print('|---|--:|--:|--:|--:|--:|--:|')
with tempfile.TemporaryDirectory() as name:
    folder = pathlib.Path(name)
    ours, theirs = folder / 'a.maille', folder / 'a.vtu'
    for path in sorted(p for f in ('hex', 'tet', 'mixed') for p in (data / f).glob('*')):
        subprocess.run([os.environ['MAILLE'], 'compress', '-q', '-f', '--mode', 'stream', *sys.argv[1:], path, ours], check=True)
        _, reader = seconds(lambda: maille_reader(ours))
        grid = reader.GetOutputDataObject(0)
        if not grid.IsA('vtkUnstructuredGrid'):
            continue
        writer = vtkXMLUnstructuredGridWriter()
        writer.SetInputData(grid)
        writer.SetFileName(str(theirs))
        writer.Write()
        a, _ = seconds(lambda: vtu_reader(theirs))
        b, _ = seconds(lambda: maille_reader(ours))
        print(f'| {path.name} | {grid.GetNumberOfCells():,} | {theirs.stat().st_size:,} | {ours.stat().st_size:,} | {a * 1e3:.1f} | '
              f'{b * 1e3:.1f} | {a / b:.2f} |', flush=True)
