# An address stands wherever a .maille file is read; of a part, little more than that part is fetched.
export no_proxy=127.0.0.1
# No coordinate comes again: a table of them would stand before the first picture.
python3 -c '
w, h = 257, 129
print("ply\nformat ascii 1.0\nelement vertex %d" % (w * h))
print("property float x\nproperty float y\nproperty float z\nelement face %d" % (2 * (w - 1) * (h - 1)))
print("property list uchar int vertex_indices\nend_header")
noise = lambda i: (i * 2654435761 % 4294967296) / 4294967296 / 400
for i in range(w * h):
    print("%.6f %.6f %.6f" % (i % w / 256 + noise(3 * i), i // w / 128 + noise(3 * i + 1), 1 + noise(3 * i + 2)))
for y in range(h - 1):
    for x in range(w - 1):
        a = y * w + x
        print("3 %d %d %d\n3 %d %d %d" % (a, a + 1, a + w, a + 1, a + w + 1, a + w))
' > fine.ply
maille compress -q --mode random fine.ply
maille compress -q -2 fine.ply plain.maille
maille serve -q --port 0 . > address &
server=$!
until [[ -s address ]]; do kill -0 $server || exit 9; sleep 0.05; done
url=$(cat address)
maille extract -q fine.maille part.ply --box 0,0,0,0.3,0.3,2
maille extract --json "${url}fine.maille" far.ply --box 0,0,0,0.3,0.3,2 > fetched.json
maille diff part.ply far.ply
json 'j["fetched"]["round_trips"] <= 3, j["fetched"]["bytes"] < j["fetched"]["of_bytes"]' < fetched.json
maille extract "${url}fine.maille" first.ply --triangles 3000 2> first.txt
sed -n 's/^fetched .* in/fetched in/p' first.txt
maille info "${url}plain.maille" | head -1
maille info --json --tree "${url}fine.maille?signature=secret" | json 'j["file"].split("/")[3:], j["cells"]'
maille verify "${url}fine.maille"
maille diff "${url}fine.maille" "${url}plain.maille"
mkdir here
(cd here && maille decompress -q "${url}plain.maille" && maille diff plain.ply ../fine.ply)
maille convert -q "${url}plain.maille" again.obj && maille diff again.obj fine.ply
maille diff "${url}part.ply" part.ply
try maille extract "${url}plain.maille" no.ply
try maille extract "${url}nothing.maille" no.ply
try maille info "${url}nothing.maille?signature=secret"
try maille extract "${url}fine.ply" no.ply
kill $server
wait $server
try maille info "${url}fine.maille"

# A server that knows no ranges: small files come whole, large ones do not by accident.
python3 -u -c '
import http.server
class Quiet(http.server.SimpleHTTPRequestHandler):
    def log_message(self, *rest): pass
class Server(http.server.ThreadingHTTPServer):
    def handle_error(self, *rest): pass  # who leaves early is no error
server = Server(("127.0.0.1", 0), Quiet)
print("http://127.0.0.1:%d/" % server.server_port)
server.serve_forever()' > plain_address &
server=$!
until [[ -s plain_address ]]; do kill -0 $server || exit 9; sleep 0.05; done
url=$(cat plain_address)
maille extract -q "${url}fine.maille" whole.ply --box 0,0,0,0.3,0.3,2 && maille diff part.ply whole.ply
try maille extract "${url}fine.maille" no.ply --fetch-limit 20K
try maille info "${url}fine.maille" --fetch-limit no
maille decompress -q "${url}fine.maille" whole.vtu && maille diff whole.vtu fine.ply
kill $server
wait $server 2> /dev/null
files_like 'no.*'
