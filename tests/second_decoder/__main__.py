"""python3 tests/second_decoder COMMAND FILES: what differs from what the command decompresses."""
import sys
import tempfile
import compare
import more
from decode import decode

with tempfile.TemporaryDirectory() as folder:
    for path in sys.argv[2:]:
        print(path, compare.differences(decode(path), compare.decompressed(sys.argv[1], path, folder)))
