#!/bin/sh
# The whole way once: a mesh becomes a level set, a cloud, a mesh to look at, and a picture.
# Usage: demo.sh PROGRAM FOLDER
set -eu
program=$1
folder=$2
data=$(dirname "$0")
mkdir -p "$folder"

"$program" info "$data/cloud_base.obj"
"$program" cloud "$data/cloud_base.obj" -o "$folder/cloud.vdb" --resolution 480 --frequency 7x --billow 0.7 --seed 7
"$program" render "$folder/cloud.vdb" -o "$folder/cloud.exr" --preview "$folder/cloud.png" --size 1280x720

echo
echo "The cloud:   $folder/cloud.vdb   (density; opens in Blender, Houdini, vdb_view)"
echo "The picture: $folder/cloud.exr   (linear, premultiplied)"
echo "             $folder/cloud.png   (preview)"
