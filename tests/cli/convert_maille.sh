# .maille on either side of convert, recognised by its first bytes.
maille convert -q house.obj house.maille
maille diff --same-order house.obj house.maille
mv house.maille house.renamed
maille convert -q house.renamed back.obj
maille diff --same-order house.obj back.obj
maille convert -q - - --input-format maille --output-format maille < house.renamed | maille diff - house.obj
