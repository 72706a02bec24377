# The same file for any number of threads, and any folder the input lies in.
maille compress -q -T 1 wave.ply one.maille
maille compress -q -T 2 wave.ply two.maille
maille compress -q --threads 0 ./wave.ply all.maille
mkdir elsewhere
cp wave.ply elsewhere
maille compress -q elsewhere/wave.ply elsewhere.maille
cmp one.maille two.maille
cmp one.maille all.maille
cmp one.maille elsewhere.maille
