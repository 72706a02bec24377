"""Run by pvbatch, with one rank or several: prints a line of JSON with what ParaView makes of files.

MAILLE_PLUGIN: Maille.so; MAILLE_FILES: a folder with volume.maille, pieces.maille, surface.maille, run.maille, damaged.maille."""
import json
import os
import sys

from paraview.simple import (CreateRenderView, Delete, IntegrateVariables, LoadPlugin, OpenDataFile, SaveData, UpdatePipeline,
                             servermanager)

import maille_camera

LoadPlugin(os.environ['MAILLE_PLUGIN'], remote=False, ns=globals())
folder = os.environ['MAILLE_FILES']
ranks = servermanager.vtkProcessModule.GetProcessModule().GetNumberOfLocalPartitions()
answer = {'ranks': ranks}


def seen(proxy, time=None):
    UpdatePipeline(time, proxy) if time is not None else UpdatePipeline(proxy=proxy)
    information = proxy.GetDataInformation()
    return {'type': information.GetDataClassName(), 'points': information.GetNumberOfPoints(), 'cells': information.GetNumberOfCells(),
            'point arrays': sorted(proxy.PointData.keys()), 'cell arrays': sorted(proxy.CellData.keys())}


def opened(name, **properties):
    reader = OpenDataFile(os.path.join(folder, name))
    for key, value in properties.items():
        setattr(reader, key, value)
    return reader


for name in ('volume', 'pieces', 'surface'):
    answer[name] = seen(opened(name + '.maille'))
answer['level'] = seen(opened('surface.maille', Level=1))
# Cells by how far the camera is, in lengths of the box; then in parallel projection, where distance does not matter.
surface, view = opened('surface.maille'), CreateRenderView(ViewSize=[800, 600])
UpdatePipeline(proxy=surface)
bounds = surface.GetDataInformation().GetBounds()
middle = [(low + high) / 2 for low, high in zip(bounds[0::2], bounds[1::2])]
length = max(high - low for low, high in zip(bounds[0::2], bounds[1::2]))
answer['camera'], answer['camera moved'] = [], []
for distance, parallel in ((1, False), (4, False), (4, False), (100, False), (1, True), (100, True)):
    view.CameraParallelProjection, view.CameraParallelScale = int(parallel), 4 * length
    view.CameraPosition, view.CameraFocalPoint = [middle[0], middle[1], middle[2] + distance * length], middle
    answer['camera moved'].append(maille_camera.look(surface, view, pixels=1))
    answer['camera'].append(seen(surface)['cells'])
answer['region'] = seen(opened('pieces.maille', OnlyaRegion=1, Region=json.loads(os.environ['MAILLE_REGION'])))
answer['no arrays'] = seen(opened('volume.maille', PointArrays=[]))
# Sizes of all cells together: none twice, none missing.
whole = IntegrateVariables(Input=opened('pieces.maille'))
UpdatePipeline(proxy=whole)
answer['volume of pieces'] = whole.CellData.GetArray('Volume').GetRange(0)[0]
run = opened('run.maille')
answer['times'] = list(run.TimestepValues)
answer['ranges'] = []
for time in answer['times']:
    seen(run, time)
    answer['ranges'].append(list(run.PointData.GetArray('t').GetRange(0)))
damaged = opened('damaged.maille')
answer['damaged'] = seen(damaged)
if ranks == 1:
    SaveData(os.path.join(folder, 'saved.maille'), proxy=run, WriteAllTimeSteps=1, Effort=7)
    saved = opened('saved.maille')
    answer['saved'] = seen(saved)
    answer['saved times'] = list(saved.TimestepValues)
print('ANSWER ' + json.dumps(answer))
sys.stdout.flush()
