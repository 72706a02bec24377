#!/usr/bin/python3
"""Reads a volume, cuts a contour out of it at each of its times, and writes the contours compressed.

    contour.py VOLUME.maille ARRAY VALUE FOLDER

Needs maillevtk (docs/vtk.md) and VTK's Python."""
import sys

from maillevtk import vtkMailleReader, vtkMailleWriter
from vtkmodules.vtkCommonDataModel import vtkDataObject
from vtkmodules.vtkCommonExecutionModel import vtkStreamingDemandDrivenPipeline
from vtkmodules.vtkFiltersCore import vtkContourFilter

if len(sys.argv) != 5:
    sys.exit(__doc__)
path, array, value, folder = sys.argv[1:]
reader = vtkMailleReader()
reader.SetFileName(path)  # or an address, https://...
reader.UpdateInformation()
if reader.GetErrorCode():
    sys.exit(1)  # VTK has said what is wrong
times = reader.GetOutputInformation(0).Get(vtkStreamingDemandDrivenPipeline.TIME_STEPS()) or [0]

# Nothing but this array is read.
reader.GetPointArraySelection().DisableAllArrays()
reader.GetCellArraySelection().DisableAllArrays()
reader.SetPointArrayStatus(array, 1)

contour = vtkContourFilter()
contour.SetInputConnection(reader.GetOutputPort())
contour.SetInputArrayToProcess(0, 0, 0, vtkDataObject.FIELD_ASSOCIATION_POINTS, array)
contour.SetValue(0, float(value))
for i, time in enumerate(times):
    contour.UpdateTimeStep(time)
    surface = contour.GetOutput()
    print(f'time {time:g}: {surface.GetNumberOfCells()} triangles')
    writer = vtkMailleWriter()
    writer.SetInputData(surface)
    writer.SetFileName(f'{folder}/contour_{i}.maille')
    writer.KeepOrderOff()  # a smaller file
    writer.SetTolerance('', vtkMailleWriter.BITS, 16)  # of positions: 65,536 steps along the longest side
    if not writer.Write():
        sys.exit(1)
