# Names of arrays in conditions: what could be taken for an operator or a component stands in double quotes.
python3 - <<'P'
names = ['T', 'p [Pa]', 'v[0]', 'a<=b', 'say "x"', 'x=y']
arrays = ''.join(f'<DataArray type="Float32" Name="{n}" format="ascii">{i} {i + 10}</DataArray>'
                 for i, n in enumerate(n.replace('"', '&quot;').replace('<', '&lt;') for n in names))
vectors = '<DataArray type="Float32" Name="u[1]" NumberOfComponents="3" format="ascii">1 0 0 0 2 0</DataArray>'
open('two.vtu', 'w').write(f'''<VTKFile type="UnstructuredGrid" version="1.0" byte_order="LittleEndian"><UnstructuredGrid>
<Piece NumberOfPoints="8" NumberOfCells="2"><Points><DataArray type="Float32" NumberOfComponents="3" format="ascii">
0 0 0 1 0 0 0 1 0 0 0 1 5 0 0 6 0 0 5 1 0 5 0 1</DataArray></Points><Cells>
<DataArray type="Int32" Name="connectivity" format="ascii">0 1 2 3 4 5 6 7</DataArray>
<DataArray type="Int32" Name="offsets" format="ascii">4 8</DataArray>
<DataArray type="UInt8" Name="types" format="ascii">10 10</DataArray></Cells>
<CellData>{arrays}{vectors}</CellData></Piece></UnstructuredGrid></VTKFile>''')
P
maille compress -q two.vtu
cells() {
  if maille extract -f --json two.maille part.vtu --where "$1" > answer; then
    json 'j["cells"]' < answer
  else
    echo "exit $?"
  fi
}
cells 'T > 5'
cells 'p [Pa] > 5'
cells '"p [Pa]" > 5'
cells '"v[0]" > 5'
cells '"a<=b" = 0:5'
cells '"say ""x""" <= 4'
cells '"x=y" >= 15'
cells '"u[1]"[1] >= 2'
cells '"u[1]" > 1.5'
cells ' "T" [0] > 5'
# What is wrong with a condition.
cells 'v[0] > 5'
cells 'a<=b > 5'
cells '"a<=b > 5'
cells '"T" 5 > 5'
cells '"" > 5'
cells 'u[x] > 5'
cells 't > 5'
cells '"T"[1] > 5'
