# A case of OpenFOAM with its fields goes into a file, all times of it, and comes back.
cat > blockMeshDict <<'EOF'
vertices ((0 0 0) (1 0 0) (1 1 0) (0 1 0) (0 0 1) (1 0 1) (1 1 1) (0 1 1));
blocks (hex (0 1 2 3 4 5 6 7) (2 2 1) simpleGrading (1 1 1));
boundary (inlet { type patch; faces ((0 4 7 3)); } walls { type wall; faces ((0 1 5 4)(3 7 6 2)); }
          outlet { type patch; faces ((1 2 6 5)); } sides { type empty; faces ((0 1 2 3)(4 5 6 7)); });
EOF
maille generate -q blockMeshDict case/constant/polyMesh
field() {  # TIME CLASS NAME INTERNAL INLET
  mkdir -p case/$1
  cat > case/$1/$3 <<EOF
FoamFile
{
    version     2.0;
    format      ascii;
    class       $2;
    location    "$1";
    object      $3;
}

dimensions      [0 1 -1 0 0 0 0];

internalField   $4;

boundaryField
{
    inlet
    {
        type            fixedValue;
        value           $5;
    }
    ".*"
    {
        type            zeroGradient;
    }
}
EOF
}
field 0 volVectorField U 'uniform (0 0 0)' 'uniform (1 0 0)'
for time in 0.1 1e-05; do
  field $time volVectorField U 'nonuniform List<vector> 4((1 0 0) (0.9 0.1 0) (1.1 -1e-09 0) (1 0 0))' 'uniform (1 0 0)'
  field $time surfaceScalarField phi 'nonuniform List<scalar> 4(0.25 0.5 -0.25 1e+06)' 'nonuniform List<scalar> 2(0.5 0.75)'
done
mkdir -p case/system case/0.1/uniform case/0.1/lagrangian case/0.1/polyMesh
echo 'application icoFoam;' > case/system/controlDict
echo 'value 0.1;' > case/0.1/uniform/time
try maille compress case flow.maille
maille info flow.maille | grep -E '^openfoam|^ +[0-9] |^  (U|phi)'
try maille decompress flow.maille case2
diff -r case case2 -x polyMesh
try maille diff case case2
try maille decompress flow.maille case2
try maille decompress flow.maille case2/constant/polyMesh -f
# For ParaView.
try maille decompress -q flow.maille run.pvd
cat run.pvd
try maille compress -q run.pvd run.maille
try maille decompress -q run.maille run2.pvd
for i in 0 1 2; do cmp run_$i.vtu run2_$i.vtu; done
try maille decompress flow.maille run.pvd
# One time, and one that comes later.
try maille convert -q case/0.1 one.vtu
try maille decompress -q --time 0.1 flow.maille again.vtu
try maille diff one.vtu again.vtu
field 0.2 volVectorField U 'uniform (2 0 0)' 'uniform (1 0 0)'
try maille append flow.maille case/0.2
try maille decompress -q flow.maille case3
diff -r case case3 -x polyMesh
# Loss where it is allowed, of a field that begins later, too.
try maille compress -q -f --error U=0.01 --error phi=0.1 case small.maille
try maille decompress -q small.maille case4
sed -n '/internalField/p' case4/0/U case4/0.1/U case4/0.1/phi
try maille compress -q --error q=1 case bad.maille
# What does not fit.
field 0.3 volVectorField U 'nonuniform List<vector> 1((2 0 0))' 'uniform (1 0 0)'
try maille compress case bad.maille
rm -r case/0.3
touch case/0.1/polyMesh/points
try maille compress case bad.maille
try maille compress --any-order case bad.maille
ls *.maille
