# shellcheck shell=bash
# Loaded before each case.

# Runs a command that may fail and says how it ended.
try() {
  "$@"
  echo "exit $?"
}

# Reads JSON on standard input and prints a Python expression of it, named `j`.
json() {
  python3 -c 'import json, sys; j = json.load(sys.stdin); print(eval(sys.argv[1]))' "$1"
}

# The folder holds no file that was not there before, hidden temporary files included.
files_like() {
  find . -name "$1" | sort
}
