#!/bin/sh
# Puts the program's own --help-all text into the pages of its verbs, between the marks
#   <!-- help VERB -->  and  <!-- end of help -->
# and the list of what scripts may call into felt_functions.md. With --check it changes nothing and fails where a page is out of date. It also checks that local links lead somewhere.
# Usage: update_help.sh PROGRAM [--check]
set -eu
program=$1
mode=${2:-write}
cd "$(dirname "$0")"
failed=0

for page in *.md; do
  verb=$(sed -n 's/^<!-- help \([a-z]*\) -->$/\1/p' "$page" | head -n 1)
  [ -n "$verb" ] || continue
  fresh=$(mktemp)
  "$program" "$verb" --help-all >"$fresh.help"
  awk -v help="$fresh.help" '
    /^<!-- help [a-z]* -->$/ { print; print "```text"; while ((getline line < help) > 0) print line; print "```"; skip = 1; next }
    /^<!-- end of help -->$/ { skip = 0 }
    !skip { print }' "$page" >"$fresh"
  if ! cmp -s "$page" "$fresh"; then
    if [ "$mode" = --check ]; then
      echo "error: docs/$page does not show the current help of '$verb'; run make docs" >&2
      failed=1
    else
      cat "$fresh" >"$page"
      echo "docs/$page: updated"
    fi
  fi
  rm -f "$fresh" "$fresh.help"
done

fresh=$(mktemp)
"$program" felt functions --markdown >"$fresh"
if ! cmp -s felt_functions.md "$fresh"; then
  if [ "$mode" = --check ]; then
    echo "error: docs/felt_functions.md does not list the current functions; run make docs" >&2
    failed=1
  else
    cat "$fresh" >felt_functions.md
    echo "docs/felt_functions.md: updated"
  fi
fi
rm -f "$fresh"

for page in *.md ../README.md; do
  for target in $(grep -oE '\]\([^)#: ]+(#[^)]*)?\)' "$page" | sed -E 's/^\]\(//; s/(#[^)]*)?\)$//'); do
    if [ ! -e "$(dirname "$page")/$target" ]; then
      echo "error: docs/$page links to $target, which is not there" >&2
      failed=1
    fi
  done
done
exit "$failed"
