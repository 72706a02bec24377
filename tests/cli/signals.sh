# Stopped at work, the command leaves nothing behind: neither a file under the final name nor a temporary one.
# A mesh large enough to be caught while it is read: the output is open by then.
python3 - > large.ply << 'END'
n = 400
print('ply\nformat ascii 1.0\nelement vertex %d\nproperty float x\nproperty float y\nproperty float z' % (n * n))
print('element face %d\nproperty list uchar int vertex_indices\nend_header' % ((n - 1) * (n - 1)))
for j in range(n):
    for i in range(n):
        print(i, j, (i * j) % 17)
for j in range(n - 1):
    for i in range(n - 1):
        print(4, j * n + i, j * n + i + 1, j * n + n + i + 1, j * n + n + i)
END
# The shell ignores SIGINT and SIGQUIT on behalf of its background jobs; Python gives them back.
default_signals='import os, signal, sys; [signal.signal(s, signal.SIG_DFL) for s in (signal.SIGINT, signal.SIGQUIT)]; os.execvp(sys.argv[1], sys.argv[1:])'
# Writing to a file that has no name, or one of its own meanwhile.
named=no
is_writing() {
  # In this folder: the shell that started the tests may hold files of its own that were deleted.
  compgen -G '.*part' > /dev/null && named=yes || ls -l "/proc/$1/fd" 2> /dev/null | grep -q "$PWD/.*deleted"
}
stop() {
  python3 -c "$default_signals" maille compress -q large.ply out.maille &
  while ! is_writing $!; do kill -0 $! 2> /dev/null || break; done
  kill "-$1" $!
  wait $! 2> /dev/null
  echo "$1: exit $?"
  files_like 'out.maille'
}
stop INT
files_like '.*part'
stop TERM
files_like '.*part'
stop HUP
files_like '.*part'
stop XCPU
files_like '.*part'
stop QUIT
files_like '.*part'
stop KILL
[[ $named == yes ]] || files_like '.*part'
