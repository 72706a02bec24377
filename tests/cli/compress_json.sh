# The figures add up.
maille compress --json -e 0.001 --error normal=0.01 wave.ply wave.maille > report
json 'sorted(j)' < report
json 'sorted(j["positions"])' < report
json 'j["points"], j["cells"], j["connectivity"]["domain"], [a["name"] for a in j["arrays"]]' < report
json 'j["positions"]["coded_bytes"] + j["connectivity"]["coded_bytes"] + sum(a["coded_bytes"] for a in j["arrays"]) + j["order_bytes"] + j["other_bytes"] == j["file_bytes"]' < report
json 'abs(j["positions"]["bound"] - 0.001) < 1e-9, 0 < j["positions"]["maximum_error"] <= 0.001, j["positions"]["lossless"]' < report
json '[(a["lossless"], round(a["bound"], 6), a["maximum_error"] <= a["bound"]) for a in j["arrays"]]' < report
test "$(stat -c %s wave.maille)" = "$(json 'j["file_bytes"]' < report)"
