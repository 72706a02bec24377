# Every level and every other codec is there: measured, or named as missing, or as not for this precision.
maille bench --json --repeat 1 wave.ply tetra.off > report
json '[(r["file"], r["points"], r["faces"], r["bits"]) for r in j]' < report
json 'sorted(c["codec"] for c in j[0]["codecs"] + j[0]["missing"])' < report
json '[c["round_trip"] for c in j[0]["codecs"] if "maille" in c["codec"]]' < report
json 'sorted(set(j[0]["codecs"][4]) - {"ratio"})' < report
json 'all(c["bits_per_point"] == 8 * c["bytes"] / j[0]["points"] for c in j[0]["codecs"] if "failed" not in c)' < report
json 'all(p.get("exact", True) and p["bytes"] > 0 for p in j[0]["whole_file"]), [p["packer"] for p in j[0]["whole_file"] if "maille" in p["packer"]]' < report
maille compress -q wave.ply --no-provenance wave.maille
test "$(stat -c %s wave.maille)" = "$(json '[p["bytes"] for p in j[0]["whole_file"] if p["packer"] == "maille -5"][0]' < report)" && echo "as compress makes it"
maille bench --json --lossless --codec draco,maille --levels 5 --against 'maille -5' tetra.off > report
json '[(c["codec"], c["ratio"]) for c in j[0]["codecs"]], j[0]["against"], j[0]["bits"]' < report
json '"draco -cl 10" in str(j[0]["missing"]) + str(j[0]["notes"])' < report
