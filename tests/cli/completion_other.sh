# No zsh or fish to ask, so: every verb and long option is in the script.
maille completion zsh > zsh
maille completion fish > fish
head -1 zsh fish
for verb in compress decompress info verify diff convert completion; do
  grep -q "'$verb:" zsh || echo "zsh: $verb is missing"
  grep -q -- "-a $verb " fish || echo "fish: $verb is missing"
  maille "$verb" --help > help  # not into grep -q, which may close the pipe first
  grep -o -- '--[a-z][a-z-]*' help | sort -u | while read -r option; do
    [[ $option == --help ]] && continue
    grep -q "^  .*$option" help || continue
    grep -q -- "'\*\?$option\[" zsh || echo "zsh: $verb $option is missing"
    grep -q -- "$verb.* -l ${option#--} " fish || echo "fish: $verb $option is missing"
  done
done
