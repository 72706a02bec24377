# What info tells of a volume: cells by type, also of mixed blocks, ranges of fields without NaN, memory to decode.
cat > mixed.vtk <<'END'
# vtk DataFile Version 3.0
mixed
ASCII
DATASET UNSTRUCTURED_GRID
POINTS 9 float
0 0 0  1 0 0  1 1 0  0 1 0  0 0 1  1 0 1  1 1 1  0 1 1  0.5 0.5 -2
CELLS 3 19
8 0 1 2 3 4 5 6 7
5 3 2 1 0 8
3 4 5 6
CELL_TYPES 3
12
14
5
POINT_DATA 9
SCALARS pressure float 1
LOOKUP_TABLE default
1 2 3 nan 5 6 7 nan -8.5
VECTORS velocity double
0 0 1  0 0 2  0 0 3  0 0 4  0 0 5  0 0 6  0 0 7  0 0 8  nan 0.5 9
CELL_DATA 3
SCALARS nothing float 1
LOOKUP_TABLE default
nan nan nan
END
try maille compress -q mixed.vtk
maille info mixed.maille | grep -v 'size:\|written by\|in use'
maille info --json mixed.maille | grep -A 12 '"types"' | tr -d ' \n'
