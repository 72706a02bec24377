"""Run by pvpython, a client of pvserver at MAILLE_PORT: prints a line of JSON with the cells of each file, and the ranks that have some.

MAILLE_PLUGIN, MAILLE_FILES: as for test_plugin.py."""
import json
import os
import sys

from paraview import simple
from paraview.simple import Connect, LoadPlugin, OpenDataFile, UpdatePipeline

ProcessIds = getattr(simple, 'GenerateProcessIds', None) or simple.ProcessIdScalars  # its name since 5.12; before
Connect('localhost', int(os.environ['MAILLE_PORT']))
for remote in (True, False):
    LoadPlugin(os.environ['MAILLE_PLUGIN'], remote=remote, ns=globals())
answer = {}
for name in ('pieces', 'surface'):
    ranks = ProcessIds(Input=OpenDataFile(os.path.join(os.environ['MAILLE_FILES'], name + '.maille')))
    UpdatePipeline(proxy=ranks)
    low, high = next(ranks.PointData.GetArray(key) for key in ranks.PointData.keys() if 'ProcessId' in key).GetRange(0)
    answer[name] = {'cells': ranks.GetDataInformation().GetNumberOfCells(), 'ranks': [low, high]}
print('ANSWER ' + json.dumps(answer))
sys.stdout.flush()
