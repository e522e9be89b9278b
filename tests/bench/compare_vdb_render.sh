#!/bin/sh
# Compares `nephele render` with OpenVDB's vdb_render: the same fog, camera and sun, 640x480.
#
#   compare_vdb_render.sh NEPHELE MESH.obj [FOLDER]
#
# vdb_render's -gain 0 is single scattering with isotropic phase and radiance colour * albedo, so that our sun has the
# irradiance 4 pi. It counts extinction per voxel: ours is that divided by the voxel size. Both take one ray through every
# pixel's centre; vdb_render's steps and shadow steps are one voxel long, ours at most three, at a smaller error. With
# NEPHELE_RENDER_OPTIONS='--adaptive 0.08' pixels whose neighbours agree within 8 % are interpolated. The reference is
# vdb_render at a tenth of the step, without cutoffs, on every fifth pixel.
#
# Prints, for several extinctions per voxel, seconds of the whole programs (medians of three), of a frame of a turntable
# after its light is made (mean of 24, median of three turntables), and root mean square errors.
set -eu
nephele=$1
mesh=$2
folder=${3:-$(mktemp -d)}
mkdir -p "$folder"
cd "$folder"
vdb_tool -quiet -read "$mesh" -mesh2ls dim=250 -ls2fog -write fog.vdb
voxel=$(vdb_print -l fog.vdb | awk '/voxel size/ {print $NF}')

median() { sort -g | sed -n 2p; }
seconds() {  # of a command
  for i in 1 2 3; do
    start=$(date +%s.%N)
    "$@" >/dev/null 2>&1
    end=$(date +%s.%N)
    echo "$start $end" | awk '{print $2 - $1}'
  done | median
}
frame_seconds() {  # of the options of a turntable
  for i in 1 2 3; do
    "$nephele" turntable fog.vdb -o frames/fog.####.exr --frames 1-24 --stats frames.json "$@" >/dev/null 2>&1
    awk '/"frames": \[/ {inside = 1} /\]/ {inside = 0} inside && /"seconds"/ {gsub(",", ""); sum += $2; ++count}
      END {print sum / count}' frames.json
  done | median
}
error() {  # root mean square of the red channel against the reference
  oiiotool "$1" --ch R --resample:interp=0 128x96 reference.exr --ch R --diff 2>&1 | awk '/RMS error/ {print $NF; exit}'
}

camera="-res 640x480 -translate 0,0.4,3.2 -lookat 0,0,0 -fov 32 -light 0.5,0.6,0.6,1,1,1 -gain 0"
ours="--size 640x480 --camera-position 0,0.4,3.2 --look-at 0,0,0 --fov 32 --sun 39.80557,37.53035,12.5663706 --sky 0,0,0
  --phase isotropic --octaves 1 --samples 1 --aov none ${NEPHELE_RENDER_OPTIONS:-}"
mkdir -p frames
echo "extinction/voxel  vdb_render s  nephele s  ratio  frame s  ratio  vdb_render error  nephele error"
for pair in 0.02:0.0001 0.05:0.00025 0.085:0.000425 0.1:0.0005 0.5:0.0025 1.5:0.1; do
  scatter=${pair%:*}
  absorb=${pair#*:}
  medium="-scatter $scatter,$scatter,$scatter -absorb $absorb,$absorb,$absorb"
  total=$(echo "$scatter $absorb $voxel" | awk '{printf "%.9g", ($1 + $2) / $3}')
  albedo=$(echo "$scatter $absorb" | awk '{printf "%.9g", $1 / ($1 + $2)}')
  vdb_render fog.vdb reference.exr $camera -res 128x96 -step 0.1 -shadowstep 0.1 -cutoff 0 $medium >/dev/null 2>&1
  theirs=$(seconds vdb_render fog.vdb theirs.exr $camera -step 1 -shadowstep 1 $medium)
  step=$(echo "$voxel" | awk '{print 3 * $1}')
  same="$ours --step $step --extinction $total --albedo $albedo,$albedo,$albedo"
  mine=$(seconds "$nephele" render fog.vdb -o ours.exr $same)
  frame=$(frame_seconds $same)
  echo "$scatter $absorb $theirs $mine $frame $(error theirs.exr) $(error ours.exr)" |
    awk '{printf "%16g  %12.2f  %9.3f  %5.1f  %7.4f  %5.0f  %16g  %13g\n", $1 + $2, $3, $4, $3 / $4, $5, $3 / $5, $6, $7}'
done
