# The steps of an EnSight case whose mesh stays become steps of one file.
cp "$HERE"/../formats/ensight/le_stars* .
sed -e 's/^model: .*/model: le_stars002.geo/' le_stars.case > run.case
maille compress -q run.case
maille info --json run.maille | json '[(step["time"], step["arrays"]) for step in j["steps"]]'
maille verify run.maille --against run.case | head -2
# Where points move they cannot.
try maille compress -q le_stars.case moving.maille
try maille convert le_stars.case run.vtu
# A folder of that name is a case of OpenFOAM.
mkdir -p flow.case/constant && cp -r "$HERE/../formats/polymesh" flow.case/constant/polyMesh
maille compress -q flow.case flow.maille && maille info --json flow.maille | json 'j["cells"]'
# A case without time.
cp "$HERE"/../formats/ensight/all.* .
maille compress -q all.case && maille info --json all.maille | json '(j["cells"], len(j["steps"]))'
