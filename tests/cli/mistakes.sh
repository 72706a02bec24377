# What users get wrong, each time one sentence that says what to do, and the exit code of its kind.
maille compress -q tetra.off tetra.maille
maille compress -q --mode random cube.ply cube.maille
maille generate -q blockMeshDict hexes.vtu
maille compress -q hexes.vtu hexes.maille
mkdir folder
# Verbs and names.
try maille extrakt tetra.maille out.ply
try maille unpack tetra.maille
try maille tetra.off
try maille --compress tetra.off
try maille compress tetra.of
try maille compress folder
try maille compress -r folder
try maille decompress tetra.off
try maille decompress tetra.maille tetra.maile
try maille decompress tetra.maille folder
try maille decompress tetra.maille nowhere/tetra.ply
try maille compress tetra.off tetra.maille
try maille compress tetra.off tetra.ply
try maille convert tetra.off
try maille info folder
try maille verify folder
# Options and levels.
try maille compress -10 tetra.off
try maille compress tetra.off out.maille -10
try maille compress -f --keep_order tetra.off
try maille compress -f --quality 9 tetra.off
try maille compress -f --threads=many tetra.off
try maille compress -f --memory 0 tetra.off
try maille compress -f --for printing tetra.off
try maille compress -f --mode randomm tetra.off
try maille compress -f --input-format PLY tetra.off
try maille decompress -f --output-format jpg tetra.maille
# Bounds.
try maille compress -f -e 0.1mm tetra.off
try maille compress -f -e 0,1 tetra.off
try maille compress -f -e 5px tetra.off
try maille compress -f --bits normal tetra.off
try maille compress -f --bits normal=10 --bits txcoord=12 tetra.off
try maille compress -f --bits 14=position tetra.off
try maille compress -f --error T=0.5 tetra.off
try maille compress -q -f --psnr -3 tetra.off
try maille compress -f --psnr loud tetra.off
# Pipes.
try maille compress - out.maille < /dev/null
try maille decompress - out.ply < tetra.off
try maille convert - out.ply < /dev/null
try maille compress --pieces auto tetra.off pieces.maille
# Steps, parts and places.
try maille decompress -f tetra.maille out.ply --step 3
try maille decompress -f hexes.maille out.vtu --time 0.5
try maille append tetra.maille tetra.off
try maille append hexes.maille tetra.off
try maille extract tetra.maille out.ply --triangles 100
try maille extract cube.maille out.ply --box 0,0,0,1,1
try maille extract cube.maille out.ply --box 1,1,1,0,0,0
try maille extract cube.maille out.ply --box=9,9,9,10,10,10
try maille extract cube.maille out.ply --triangles few
try maille extract hexes.maille out.vtu --where 'T > 5'
try maille slice cube.maille out.vtu
try maille probe hexes.maille 1,2
# A second name that was meant as the output, several inputs with one output, an option that took the input.
try maille compress -f tetra.off ./tetra.off
try maille decompress -f tetra.maille tetra.maille
try maille compress -f tetra.off cube.ply both.maille
try maille compress -f -e tetra.off
try maille compress -f tetra.off folder
try maille compress tetra.maille
# Options of other verbs, or of none.
try maille decompress tetra.maille out.ply --triangles 5
try maille decompress tetra.maille out.ply -e 0.1
try maille decompress tetra.maille -7
try maille decompress tetra.maille out.ply --step=2 --keep-order
try maille convert cube.ply out.vtu -9
try maille info -v tetra.maille
try maille verify tetra.maille cube.ply
try maille extract cube.maille --box 0,0,0,1,1,1
# Numbers.
try maille compress -f --bits 99 tetra.off
try maille compress -f -e -1 tetra.off
try maille compress -f -e inf tetra.off
try maille compress -f --pieces 0 hexes.vtu
try maille compress -f --pieces many hexes.vtu
try maille extract cube.maille out.ply --error -1
try maille extract cube.maille out.ply --level -1
try maille extract cube.maille out.ply --sphere 0,0,0,-1
try maille extract cube.maille out.ply --box a,b,c,d,e,f
try maille extract hexes.maille out.vtu --cells 5
try maille extract hexes.maille out.vtu --cells 900:901
try maille extract hexes.maille out.vtu --step 4
try maille slice hexes.maille out.vtp --plane 99,0,0,1,0,0
try maille generate blockMeshDict out.vtu --refine 0
# What is not what the verb takes.
echo 'once upon a time' > text.ply
try maille compress text.ply out.maille
try maille decompress text.ply out.off
try maille slice tetra.off out.vtp --plane 0,0,0,1,0,0
try maille generate tetra.off out.vtu
try maille subdivide hexes.vtu out.off
try maille compress -f --mode random hexes.vtu out.maille
try maille extract tetra.off out.ply
try maille append hexes.maille nowhere.vtu
try maille append hexes.maille hexes.vtu --time soon
try maille append --remove-last hexes.maille
# Addresses.
try maille decompress htp://localhost/a.maille out.ply
try maille decompress https//localhost/a.maille out.ply
# Names of arrays.
try maille compress -f --drop colr cube.ply out.maille
try maille decompress -f --arrays color cube.maille out.ply
try maille decompress -f --arrays T hexes.maille out.vtu
# Damage: the sentence says how to get what is whole.
damage() {
  cp "$1" damaged.maille
  printf '\377\377\377' | dd of=damaged.maille bs=1 seek="$2" conv=notrunc status=none
}
maille compress -q --pieces 40 hexes.vtu pieces.maille
damage hexes.maille 340
try maille decompress damaged.maille out.vtu
try maille convert damaged.maille out.vtu
try maille slice damaged.maille out.vtu --plane 0.1,0,0,1,0,0
place=$(maille info --json --chunks pieces.maille | json '[c["offset"] for c in j["chunks"] if c["type"] == "PIDX"][0]')
damage pieces.maille $((place + 20))
try maille extract damaged.maille out.vtu --box=0,0,0,1,1,1
damage tetra.maille 70
try maille decompress damaged.maille out.ply
try maille decompress -q --salvage damaged.maille out.ply
files_like 'out.*'
