# Binary data is not written to a terminal, and a terminal is no mesh. (script makes a terminal.)
on_terminal() {
  script -qec "$1; echo exit \$?" /dev/null < /dev/null | tr -d '\r'
}
on_terminal 'maille compress cube.ply -'
on_terminal 'maille convert cube.ply - --output-format ply'
on_terminal 'maille convert tetra.off - --output-format off -q'
script -qec 'maille info -; echo exit $?' /dev/null < /dev/null 2>&1 | tr -d '\r'
