# What a client of `maille serve` gets: ranges, types, headers for web pages, and no file from elsewhere.
export MAILLE_VIEWER=$PWD/none  # whether one was built is not of interest here
mkdir -p shown/in secret
echo outside > secret/key
head -c 100000 /dev/zero > shown/zeros.maille
echo '<p>hi' > shown/in/index.html
echo hidden > shown/.hidden
echo 'a name' > 'shown/a&b <c>.txt'
: > shown/empty.maille
ln -s ../secret/key shown/link
ln -s zeros.maille shown/inside.maille
ln -s ../secret shown/folder
mkfifo shown/pipe
maille serve --port 0 shown > address 2> said &
server=$!
until [[ -s address ]]; do kill -0 $server || exit 9; sleep 0.05; done
sed 's/:[0-9]*\/$/:PORT\//' address
cat said
ask() {
  python3 - "$(cat address)" "$@" << 'END'
import http.client, sys, urllib.parse
host = urllib.parse.urlparse(sys.argv[1]).netloc
method, path, wanted = sys.argv[2], sys.argv[3], dict(a.split('=', 1) for a in sys.argv[4:])
connection = http.client.HTTPConnection(host)
connection.request(method, path, headers=wanted)
answer = connection.getresponse()
body = answer.read()
print(method, path, *sys.argv[4:], '->', answer.status, len(body), *(answer.headers[n] for n in
      ('Content-Range', 'Content-Type', 'Location') if answer.headers[n]))
if '-v' in path or method == 'OPTIONS':
    print('\n'.join(sorted('  %s: %s' % h for h in answer.headers.items() if h[0].startswith(('Acc', 'Cro', 'X-', 'Cac')))))
END
}
ask GET /zeros.maille
ask GET /zeros.maille Range=bytes=0-65535
ask GET /zeros.maille Range=bytes=99990-
ask GET /zeros.maille Range=bytes=-10
ask GET /zeros.maille Range=bytes=90000-200000
ask GET /zeros.maille Range=bytes=100000-
ask GET /zeros.maille Range=bytes=-0
ask GET /zeros.maille Range=bytes=0-1,5-6
ask GET /zeros.maille Range=bytes=7-9 'If-Range="other"'
etag=$(python3 -c 'import sys, urllib.request; print(urllib.request.urlopen(sys.argv[1] + "zeros.maille").headers["ETag"])' "$(cat address)")
[[ $(ask GET /zeros.maille Range=bytes=7-9 "If-Range=$etag") == *'206 3 bytes 7-9/100000'* ]] && echo 'If-Range: holds'
[[ $(ask GET /zeros.maille "If-None-Match=$etag") == *'304 0'* ]] && echo 'If-None-Match: not modified'
ask HEAD /zeros.maille
ask HEAD /zeros.maille Range=bytes=0-9
ask OPTIONS /zeros.maille
ask POST /zeros.maille
ask GET /empty.maille
ask GET /empty.maille Range=bytes=0-65535
ask GET /inside.maille Range=bytes=0-0
ask GET /in
ask GET /in/
ask GET '/a%26b%20%3Cc%3E.txt'
for path in /../secret/key /%2e%2e/secret/key /in/../../secret/key /link /folder/key /folder/ /.hidden /pipe //etc/passwd /zeros.maille%00 /none; do
  ask GET $path
done
python3 -c 'import sys, urllib.request; print(urllib.request.urlopen(sys.argv[1]).read().decode(), end="")' "$(cat address)"
kill $server
wait $server
echo "exit $?"

# One file alone; another server at its port; Ctrl-C.
default_signals='import os, signal, sys; signal.signal(signal.SIGINT, signal.SIG_DFL); os.execvp(sys.argv[1], sys.argv[1:])'
: > address
python3 -c "$default_signals" maille serve --json -v --port 0 shown/zeros.maille > one.json 2> said &
server=$!
until [[ -s one.json ]]; do kill -0 $server || exit 9; sleep 0.05; done
json 'j["address"].split("/")[3]' < one.json
json 'j["address"].rsplit("/", 1)[0] + "/"' < one.json > address
ask GET /zeros.maille Range=bytes=0-3
ask GET /empty.maille
ask GET /
try maille serve --port "$(json 'j["port"]' < one.json)" shown
kill -INT $server
wait $server
echo "exit $?"
cat said
try maille serve nothing
try maille serve shown --port 70000

# Clients that never come to the end of a request do not keep others waiting.
: > address
maille serve --port 0 shown > address 2> said &
server=$!
until [[ -s address ]]; do kill -0 $server || exit 9; sleep 0.05; done
python3 - "$(cat address)" << 'END'
import http.client, socket, sys, threading, urllib.parse
place = urllib.parse.urlparse(sys.argv[1])
slow = [socket.create_connection((place.hostname, place.port)) for _ in range(100)]
answered = threading.Event()
def send_on():
    while not answered.wait(0.5):
        for each in slow:
            try:
                each.send(b'GET /zeros.maille HTTP/1.1\r\n' if each not in begun else b'A: b\r\n')
                begun.add(each)
            except OSError:
                begun.discard(each)
                slow[slow.index(each)] = socket.create_connection((place.hostname, place.port))
begun = set()
threading.Thread(target=send_on).start()
answers = []
for _ in range(3):
    connection = http.client.HTTPConnection(place.netloc, timeout=60)
    connection.request('GET', '/in/')
    answers.append(connection.getresponse().status)
answered.set()
print('beside 100 slow clients:', *answers)

# One that sends headers without end is cut off.
endless = socket.create_connection((place.hostname, place.port))
endless.sendall(b'GET / HTTP/1.1\r\n')
try:
    for _ in range(100000):
        endless.sendall(b'A: ' + b'b' * 5000 + b'\r\n')
    print('takes any number of headers')
except OSError:
    print('cut off')
bare = socket.create_connection((place.hostname, place.port))
bare.sendall(b'GET ?query HTTP/1.1\r\nConnection: close\r\n\r\n')
print(bare.recv(12).decode())
END
kill $server
wait $server
echo "exit $?"
