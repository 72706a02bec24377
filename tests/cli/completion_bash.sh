maille completion bash > completion
bash -n completion
# What follows the words typed so far.
complete_after() {
  bash -c '. ./completion; compopt() { :; }; COMP_WORDS=("$@"); COMP_CWORD=$((${#COMP_WORDS[@]} - 1)); _maille; echo "${COMPREPLY[*]}"' \
    _ "$@"
}
complete_after maille c
complete_after maille ''
complete_after maille compress --rel
complete_after maille c --mode ''
complete_after maille compress --progress a
complete_after maille decompress --output-format o
complete_after maille compress cube_
complete_after maille compress -o house
complete_after maille completion ''
complete_after maille compress --bits ''
