#!/usr/bin/env python3
"""Writes the XDMF files beside it by meshio (Debian: python3-meshio). Needed only to change them."""
import os
from pathlib import Path

import meshio
import numpy as np

os.chdir(Path(__file__).parent)
points = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1], [2, 0, 0], [2, 1, 0.5]])
cells = [('hexahedron', np.arange(8).reshape(1, 8)), ('tetra', np.array([[1, 8, 9, 5]])), ('triangle', np.array([[0, 1, 2], [2, 3, 0]]))]
mesh = meshio.Mesh(points, cells, point_data={'T': np.arange(10) * 1.5, 'v': np.arange(30, dtype='f4').reshape(10, 3)},
                   cell_data={'id': [np.array([1]), np.array([2]), np.array([3, 4])]})
for data_format in ('XML', 'HDF'):
    meshio.write(f'mixed_{data_format.lower()}.xdmf', mesh, data_format=data_format)
with meshio.xdmf.TimeSeriesWriter('series.xdmf', data_format='XML') as series:
    series.write_points_cells(points, [('tetra', np.array([[1, 8, 9, 5], [0, 1, 2, 4]]))])
    for time in (0.0, 0.5):
        series.write_data(time, point_data={'T': np.arange(10) + time}, cell_data={'q': [np.array([1., 2.]) + time]})
