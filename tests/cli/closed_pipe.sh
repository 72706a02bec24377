# A reader that went away and the shell's limit on file sizes: exit code 9, one sentence for the limit, nothing left.
nobody_reads='import os, subprocess, sys
read, write = os.pipe()
os.close(read)
print("exit", subprocess.run(sys.argv[1:], stdout=write).returncode)'
maille compress -q wave.ply
for words in 'compress -q wave.ply -' 'decompress -q wave.maille -' 'info wave.maille'; do
  python3 -c "$nobody_reads" maille $words
done
python3 -c 'import random; random.seed(1)
for i in range(2000): print("v", i, random.random(), random.random())
for i in range(1, 1999): print("f", i, i + 1, i + 2)' > strip.obj
(ulimit -f 1; try maille convert -q strip.obj strip.ply)
(ulimit -f 1; try maille compress -q strip.obj strip.maille)
files_like 'strip.[pm]*'
files_like '.*part'
