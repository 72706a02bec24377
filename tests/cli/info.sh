maille compress -q --bits 12 wave.ply
maille info wave.maille
maille info --chunks wave.maille | grep -A99 '^chunks'
# Where a mesh of which parts are read lies, to ask for a part.
maille compress -q --mode random wave.ply levels.maille
maille info levels.maille | grep '^lies in'
