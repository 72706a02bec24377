# A stencil of one's own, and answers for programs.
echo '{"name": "four points", "target": [0.5], "known": [[-1], [0], {"label": "next", "position": [1]}, [2]]}' > four.json
maille stencil --file four.json
maille stencil --json --file - < four.json | json '[round(16 * k["weight"], 9) for k in j["known"]], j["exactness"], j["rule"]["kind"]'
maille stencil --json polygon:6:4 | json 'len(j["known"]), len(j["hidden"]), len(j["edges"])'
# What it prints can be read again.
maille stencil --json dual-parallelogram:7 --covariance gaussian > dual.json
maille stencil --json --file dual.json --covariance gaussian | diff dual.json -
maille stencil --json --noise 0.5 dual-parallelogram:7 | json 'j["rule"]'
maille stencil --json | json 'len(j), j[0]["name"]'
echo '{"target": [0, 0], "known": [[1, "x"]]}' > wrong.json
try maille stencil --file wrong.json
echo '{"target": [0, 0], "known": [[1, 0, 0]]}' > wrong.json
try maille stencil --file wrong.json
echo '{"target": [0, 0], "known": [[1, 0]], "edges": [[0, 7]]}' > wrong.json
try maille stencil --file wrong.json
echo 'target' > wrong.json
try maille stencil --file wrong.json
try maille stencil butterfly --file four.json
try maille stencil --file missing.json
