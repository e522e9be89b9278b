#!/bin/sh
# run.sh PROGRAM FOLDER SECONDS [FORMAT...]: fuzzes each format for so long, as many at once as there are processors, and says
# how many inputs it ran. What it learns stays in FOLDER/corpus and is where the next run begins; inputs that broke something
# are in FOLDER/findings, and FOLDER/history has a line for every run: format, seconds, inputs, findings.
# FUZZ_FILES: further files to begin from, folders of files that are sorted by their extensions.
# SECONDS of 0: the files to begin from alone, which are the same every time.
# FUZZ_SEED: nearly the same inputs every time: so many as take some 20 seconds, from the seeds alone, whatever SECONDS is.
set -eu
here=$(cd "$(dirname "$0")" && pwd)
program=$1 folder=$2 seconds=$3
shift 3
mkdir -p "$folder/corpus" "$folder/findings" "$folder/logs"
folder=$(cd "$folder" && pwd)
[ $# -gt 0 ] || set -- obj ply stl off gltf glb vdb nvdb exr deep hdr png chan camera toml field calls

"$program" --write-seeds="$folder/seeds"
# Larger files make every run slow and teach nothing that small ones do not.
most=16k
for files in "$here/../../data" ${FUZZ_FILES:-}; do
  for format in "$@"; do
    case $format in
      camera) extension=json ;;
      deep) extension=exr ;;
      field | calls) continue ;;
      *) extension=$format ;;
    esac
    mkdir -p "$folder/seeds/$format"
    find "$files" -name "*.$extension" -type f -size -$most | while read -r file; do
      cp "$file" "$folder/seeds/$format/$(cksum < "$file" | cut -d ' ' -f 1).$extension"
    done
  done
done

# Inputs that take a processor of 2026 about 20 seconds, under the sanitizers.
inputs_of() {
  case $1 in
    vdb) echo 200 ;;
    deep) echo 3000 ;;
    nvdb | exr) echo 500 ;;
    png | hdr) echo 1500 ;;
    chan) echo 3000 ;;
    camera | gltf | glb) echo 15000 ;;
    toml | field) echo 5000 ;;
    *) echo 3000 ;;
  esac
}

# Memory: a file of some kilobytes may not cost more than this, in one block and in all.
fuzz() {
  format=$1 begin=$(date +%s)
  corpus=$folder/corpus/$format seeds=$folder/seeds/$format limits="-max_total_time=$seconds -timeout=20" fixed=
  if [ "$seconds" = 0 ]; then
    corpus=$folder/fixed/$format limits="-runs=0 -timeout=300"
    rm -rf "$corpus"
  elif [ -n "${FUZZ_SEED:-}" ]; then
    # What was learnt before, the order of a folder, what memory comparisons saw, and where all lies in memory would change the
    # inputs. How long one takes says something of the machine here, so that only what hangs is found.
    corpus=$folder/fixed/$format limits="-runs=$(inputs_of "$format") -seed=$FUZZ_SEED -use_cmp=0 -use_memmem=0 -timeout=300"
    rm -rf "$corpus"
    find "$seeds" -type f | LC_ALL=C sort | paste -s -d , | tr -d '\n' > "$folder/logs/$format.seeds"
    seeds=-seed_inputs=@$folder/logs/$format.seeds
    setarch -R true 2> /dev/null && fixed="setarch -R"
  fi
  mkdir -p "$corpus"
  dictionary="$here/dictionaries/$format.dict"
  [ -f "$dictionary" ] && dictionary="-dict=$dictionary" || dictionary=
  ASAN_OPTIONS=quarantine_size_mb=16:allocator_release_to_os_interval_ms=500 \
  LSAN_OPTIONS=suppressions="$here/../support/lsan_suppressions.txt":print_suppressions=0 \
  $fixed "$program" --format="$format" $limits -malloc_limit_mb=300 -rss_limit_mb=1500 \
    -print_final_stats=1 $dictionary -artifact_prefix="$folder/findings/$format-" \
    "$corpus" "$seeds" > "$folder/logs/$format.log" 2>&1 && state="none" || state="FOUND"
  # In lines that are written whole, as formats end at any time.
  runs=$(sed -n 's/^stat::number_of_executed_units: *//p' "$folder/logs/$format.log")
  printf '%-8s %12s inputs, findings: %s\n' "$format" "${runs:-?}" "$state"
  printf '%s %s %s %s\n' "$format" $(($(date +%s) - begin)) "${runs:-0}" "$state" >> "$folder/history"
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
