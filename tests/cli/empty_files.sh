# Nothing at all, and text of no format, under every name: exit code 4 and a sentence, never an empty mesh.
for extension in ply obj off stl glb gltf wrl vtp vtu vtk msh mesh meshb su2 hedra e; do
  : > empty.$extension
  echo "this is no mesh" > text.$extension
  for name in empty text; do
    maille convert -q $name.$extension out.vtu 2>> errors
    echo "$name.$extension: exit $?"
  done
done
sed 's/^maille: //' errors
try maille compress - < /dev/null
try maille info - < /dev/null
