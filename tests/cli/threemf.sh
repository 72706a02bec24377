# 3MF, which slicers take: written, read by its first bytes, too, and packed as Python's zipfile has it.
maille convert wave.ply wave.3mf
maille info wave.3mf
maille compress -q wave.3mf
maille decompress -q wave.maille back.3mf
maille diff wave.3mf back.3mf
cp back.3mf unnamed
maille convert -q unnamed back.off
maille diff wave.3mf back.off
python3 -c "
import zipfile
package = zipfile.ZipFile('back.3mf')
print(package.testzip(), package.namelist())
print(package.read('3D/3dmodel.model').decode().splitlines()[:2])"
# Twice in the build, once turned and moved: applied for STL, kept for 3MF.
python3 -c "
import zipfile
with zipfile.ZipFile('wave.3mf') as old, zipfile.ZipFile('twice.3mf', 'w', zipfile.ZIP_DEFLATED) as new:
    for name in old.namelist():
        text = old.read(name).decode()
        new.writestr(name, text.replace('<build>', '<build><item objectid=\"2\" transform=\"0 1 0 -1 0 0 0 0 1 10 0 0\"/>'))"
maille compress -q twice.3mf
maille decompress twice.maille twice.stl
maille decompress -q twice.maille again.3mf
maille diff --metadata twice.3mf again.3mf
# Bounds with a unit of length: 3MF says what it counts in, glTF has metres, .maille files know where they came from.
python3 -c "
import zipfile
with zipfile.ZipFile('wave.3mf') as old, zipfile.ZipFile('inches.3mf', 'w', zipfile.ZIP_DEFLATED) as new:
    for name in old.namelist():
        new.writestr(name, old.read(name).decode().replace('\"millimeter\"', '\"inch\"'))"
bound() { maille compress -q -f --json "$@" bound.maille | json 'round(j["positions"]["bound"], 9)'; }
bound -e 0.01mm wave.3mf
bound --norm-error 10um wave.3mf
bound -e 0.254mm inches.3mf
maille compress -q -f inches.3mf inches.maille && bound -e 0.01in inches.maille
maille convert -q wave.ply wave.glb && bound -e 10mm wave.glb
maille compress -q -f --json -e 1cm wave.glb wave.maille.glb | json 'j["coded_bytes"] > 0'
try maille compress -q -e 0.1mm wave.ply bound.ply.maille
# What is no model.
python3 -c "
import zipfile
zipfile.ZipFile('letter.3mf', 'w').writestr('word/document.xml', '<w/>')"
try maille info letter.3mf
head -c 300 wave.3mf > cut.3mf
try maille info cut.3mf
