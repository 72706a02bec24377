# A file in the viewer, which is another one here: what is where, and what is said when something is not.
mkdir page empty scans
echo '<p>the viewer' > page/index.html
echo 'a script' > page/script.js
maille compress -q tetra.off scans/'a b.maille'
export MAILLE_VIEWER=$PWD/page
unset DISPLAY WAYLAND_DISPLAY
get() {
  python3 -c 'import sys, urllib.request, urllib.error
try: answer = urllib.request.urlopen(sys.argv[1])
except urllib.error.HTTPError as error: answer = error
body = answer.read()
print(answer.status, answer.url.split("/", 3)[3], len(body) if body[:1] == b"\x89" else body.decode().strip())' "$1"
}
maille view 'scans/a b.maille' > address 2> said &
server=$!
until [[ -s address ]]; do kill -0 $server || exit 9; sleep 0.05; done
sed 's/:[0-9][0-9]*\//:PORT\//' address
base=$(cut -d/ -f1-3 address)
get "$(cat address)"
get "$base/.viewer/script.js"
get "$base/.viewer"
get "$base/.viewer/none"
get "$base/.viewer/../scans/"
get "$base/a%20b.maille"
get "$base/.viewerscript.js"
# Pages of others may not read it, not even those whose name leads to this machine.
python3 - "$base/a%20b.maille" <<'END'
import sys, urllib.error, urllib.request
answer = urllib.request.urlopen(sys.argv[1])
print(answer.headers.get("Access-Control-Allow-Origin"), answer.headers.get("Cross-Origin-Resource-Policy"))
try: urllib.request.urlopen(urllib.request.Request(sys.argv[1], headers={"Host": "page.example:80"}))
except urllib.error.HTTPError as error: print(error.code, error.read().decode().strip())
END
kill $server
wait $server
cat said

# An address: only the page comes from here.
maille view -q --json https://example.org/a.maille?b=1 > view.json &
server=$!
until [[ -s view.json ]]; do kill -0 $server || exit 9; sleep 0.05; done
json 'j["address"].split("/", 3)[3]' < view.json
get "$(json 'j["address"]' < view.json | cut -d/ -f1-3)/a.maille"
kill $server
wait $server

# A folder has links, also to scenes of glTF.
maille convert -q tetra.off scans/b.glb
rm address
maille serve --port 0 scans > address 2> said &
server=$!
until [[ -s address ]]; do kill -0 $server || exit 9; sleep 0.05; done
get "$(cat address)"
kill $server
wait $server
sed 's/:[0-9][0-9]*\//:PORT\//' said

try maille view tetra.off
try maille view scans
try maille view none.maille
MAILLE_VIEWER=$PWD/empty try maille view 'scans/a b.maille'
