# Exit code 5: a file of a later version of the format. (The header of one: its layout never changes, docs/format.md.)
try maille info newer_format.bin
try maille decompress newer_format.bin out.ply
try maille verify newer_format.bin
files_like 'out*'
