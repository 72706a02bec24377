maille compress -q house.obj
maille info --json house.maille > info
json 'sorted(j)' < info
json 'j["mode"], j["order"], j["points"], j["cells"], j["corners"]' < info
json 'sum(c["size"] for c in j["chunks"]) < j["file_bytes"]' < info
test "$(stat -c %s house.maille)" = "$(json 'j["file_bytes"]' < info)"
