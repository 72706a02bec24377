maille convert --json cube.ply cube.obj | json 'sorted(j), j["points"], j["cells"], j["output_bytes"] > 0'
