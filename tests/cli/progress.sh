# JSON lines on standard error, in order; nothing when it is no terminal and nobody asked.
maille compress --lossless -q --progress json wave.ply 2> lines
python3 - lines << 'END'
import json, sys
lines = [json.loads(line) for line in open(sys.argv[1])]
print(len(lines) > 0, all(sorted(l) == ['elapsed_seconds', 'fraction', 'left_seconds', 'stage'] for l in lines))
print(all(0 <= l['fraction'] <= 1 for l in lines))
END
maille decompress --progress never wave.maille - 2>&1 > /dev/null | grep -c '%'
maille compress -q wave.ply again.maille
