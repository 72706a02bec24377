# The same file for any number of threads, and any folder the input lies in.
maille compress -q -T 1 wave.ply one.maille
maille compress -q -T 2 wave.ply two.maille
maille compress -q --threads 0 ./wave.ply all.maille
mkdir elsewhere
cp wave.ply elsewhere
maille compress -q elsewhere/wave.ply elsewhere.maille
maille compress -q -T 1000 wave.ply many.maille
cmp one.maille two.maille
cmp one.maille many.maille
cmp one.maille all.maille
cmp one.maille elsewhere.maille
# The name is part of the file, unless the provenance is left out.
cp wave.ply renamed.ply
maille compress -q --no-provenance wave.ply nameless.maille
maille compress -q --no-provenance renamed.ply nameless2.maille
cmp nameless.maille nameless2.maille
