maille diff --json cube.ply cube_shuffled.ply | json 'j["equal"], j["differences"], j["a"], j["b"]'
maille diff --json --same-order cube.ply cube_moved.ply | json 'j["equal"], len(j["differences"]) > 0, j["arrays"][0]'
