#!/bin/sh
# run.sh PROGRAM FOLDER SECONDS [FORMAT...]: fuzzes each format for so long, as many at once as there are processors, and says
# how many inputs it ran. It begins with what PROGRAM_seeds writes. What it learns stays in FOLDER/corpus and is where the next run
# begins; inputs that broke something are in FOLDER/findings, and FOLDER/history has a line for every run: format, seconds of a
# processor, inputs, how many of them could be read, findings.
# FUZZ_FILES: further files to begin from, folders of files that are sorted by their extensions.
# SECONDS of 0: the same inputs every time, the files to begin from and our own changes of them; their checksum is said.
set -eu
here=$(cd "$(dirname "$0")" && pwd)
program=$1 folder=$2 seconds=$3
shift 3
mkdir -p "$folder/corpus" "$folder/findings" "$folder/logs"
folder=$(cd "$folder" && pwd)
[ $# -gt 0 ] || set -- obj ply stl off gltf glb vdb nvdb exr deep hdr png chan camera ocio toml field felt verbs calls

rm -rf "$folder/seeds"
"${program}_seeds" "$folder/seeds"
# Larger files make every run slow and teach nothing that small ones do not.
most=16k
for files in "$here/../../data" ${FUZZ_FILES:-}; do
  for format in "$@"; do
    case $format in
      deep) extension=exr ;;
      camera | field | verbs | calls) continue ;;
      *) extension=$format ;;
    esac
    mkdir -p "$folder/seeds/$format"
    find "$files" -name "*.$extension" -type f -size -$most | while read -r file; do
      cp "$file" "$folder/seeds/$format/$(cksum < "$file" | cut -d ' ' -f 1).$extension"
    done
  done
done

# Inputs that take a processor of 2026 about 10 seconds, under the sanitizers.
inputs_of() {
  case $1 in
    deep | verbs) echo 150 ;;
    exr | nvdb | obj | ocio | vdb) echo 300 ;;
    hdr) echo 400 ;;
    camera | gltf | glb | ply | stl | png) echo 600 ;;
    chan | field | off | toml) echo 1000 ;;
    felt) echo 3000 ;;
    *) echo 6000 ;;
  esac
}

# Memory: a file of some kilobytes may not cost more than this, in one block and in all.
fuzz() {
  format=$1 same=
  # Weights by how seldom an input's edges are, and a look for leaks after each, take nearly half of the time; leaks are found
  # when the run ends, too.
  corpus=$folder/corpus/$format inputs= limits="-max_total_time=$seconds -timeout=20 -entropic=0 -detect_leaks=0"
  if [ "$seconds" = 0 ]; then
    corpus=$folder/none inputs=$folder/inputs/$format
    rm -rf "$inputs"
    "$program" --format="$format" --seeds="$folder/seeds/$format" --write-inputs="$inputs" --count="$(inputs_of "$format")" ||
      return 1
    same=", checksum $(cd "$folder" && find "seeds/$format" "inputs/$format" -type f | LC_ALL=C sort | xargs cksum | cksum | cut -d ' ' -f 1)"
    # How long an input takes says something of the machine here, so that only what hangs is found.
    limits="-runs=0 -timeout=300"
  fi
  mkdir -p "$corpus"
  dictionary="$here/dictionaries/$format.dict"
  [ -f "$dictionary" ] && dictionary="-dict=$dictionary" || dictionary=
  ASAN_OPTIONS=quarantine_size_mb=16:allocator_release_to_os_interval_ms=500 \
  LSAN_OPTIONS=suppressions="$here/../support/lsan_suppressions.txt":print_suppressions=0 \
  "$program" --format="$format" $limits -malloc_limit_mb=300 -rss_limit_mb=1500 \
    -print_final_stats=1 $dictionary -artifact_prefix="$folder/findings/$format-" \
    "$corpus" $inputs "$folder/seeds/$format" > "$folder/logs/$format.log" 2>&1 && state="none" || state="FOUND"
  # In lines that are written whole, as formats end at any time.
  stat() { sed -n "s/^stat::$1: *//p" "$folder/logs/$format.log"; }
  runs=$(stat number_of_executed_units) read=$(stat inputs_that_were_read)
  times > "$folder/logs/$format.times"
  busy=$(sed 's/[ms]/ /g' "$folder/logs/$format.times" | awk 'NR == 2 { printf "%d", 60 * $1 + $2 + 60 * $3 + $4 }')
  printf '%-8s %9s inputs, %s of them read, in %s s%s, findings: %s\n' \
    "$format" "${runs:-?}" "${read:-?}" "$busy" "$same" "$state"
  printf '%s %s %s %s %s\n' "$format" "$busy" "${runs:-0}" "${read:-0}" "$state" >> "$folder/history"
  [ "$state" = none ]
}

failed=$folder/failed
rm -f "$failed"
running=0
at_once=${FUZZ_JOBS:-$(nproc)}
for format in "$@"; do
  { fuzz "$format" || echo "$format" >> "$failed"; } &
  running=$((running + 1))
  # In groups: sh waits for all or for one that it knows.
  if [ "$running" -ge "$at_once" ]; then
    wait
    running=0
  fi
done
wait
if [ -s "$failed" ]; then
  echo "findings in $folder/findings, what was said in $folder/logs:" $(cat "$failed")
  exit 1
fi
