maille compress -q --bits 12 wave.ply
maille info wave.maille
maille info --chunks wave.maille | grep -A99 '^chunks'
