# What stands in a file is printed, but cannot steer a terminal.
printf 'ply\nformat ascii 1.0\ncomment \033[2Jgone \xff\xc2\x9b2J größe\nelement vertex 1\nproperty float x\nproperty float y\nproperty float z\nproperty float \033[31mred\nend_header\n0 0 0 0\n' > colours.ply
maille compress -q colours.ply
maille info colours.maille | grep -a -e gone -e red
printf 'MeshVersionFormatted 2\nA\033[2J 1\nEnd\n' > screen.mesh
maille convert screen.mesh screen.vtu
