#!/bin/sh
# Writes the man pages of the program and of its verbs, packed, and what shells complete by.
# Usage: write_manual.sh PROGRAM FOLDER
set -eu
program=$1
folder=$2
rm -rf "$folder"
mkdir -p "$folder"
"$program" help --man | gzip -9n >"$folder/nephele.1.gz"
for verb in $("$program" --help | sed -n '/^Verbs:/,/^$/s/^  \([a-z]*\) .*/\1/p'); do
  "$program" help --man "$verb" | gzip -9n >"$folder/nephele-$verb.1.gz"
done
for shell in bash zsh fish; do
  "$program" help --completion "$shell" >"$folder/nephele.$shell"
done
