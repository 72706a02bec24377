# From standard input to standard output, compressed on the way; the same bytes as by files.
maille compress -q --no-provenance wave.ply by_file.maille
maille compress -q --no-provenance - - < wave.ply > by_pipe.maille
cmp by_file.maille by_pipe.maille
maille compress -q --no-provenance --input-format ply - < wave.ply | cmp - by_file.maille
maille decompress - - < by_pipe.maille > back.ply
maille diff wave.ply back.ply
maille decompress -q by_pipe.maille - --output-format off --ascii | head -1
maille info - < by_pipe.maille | head -1
maille verify - --against wave.ply < by_pipe.maille | head -2
maille diff wave.ply - < by_pipe.maille
