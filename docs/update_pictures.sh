#!/bin/sh
# Renders the pictures of clouds in docs/pictures again, by the commands of the pages that show them. Volumes stay in FOLDER, and what is
# there is not grown again; pictures always are. NAME (tutorial_01, lights ...) makes only that picture; without one it makes all of them.
# Needs oiiotool (Debian's openimageio-tools) and the models of examples/ (make examples). With DISNEY=FILE.vdb in the environment, the cloud of
# Walt Disney Animation Studios at a sixteenth of its size, detail_4k.jpg is made, too.
# Usage: update_pictures.sh PROGRAM FOLDER [NAME ...]
set -eu
program=$(realpath "$1")
docs=$(cd "$(dirname "$0")" && pwd)
mkdir -p "$2"
cd "$2"
shift 2
wanted="$*"
cp -r "$docs/../data/." "$docs/recipes" "$docs/../examples" .

base=cloud_base.obj
hare=examples/hare.obj
fish=examples/clownfish
usual="--frequency 7x --seed 7"

# grow FILE.vdb VERB ...: unless it is there.
grow() {
  file=$1
  shift
  [ -e "$file" ] || { "$program" "$@" -o "growing_$file" --quiet && mv "growing_$file" "$file"; }
}

# show NAME VOLUME ...: NAME.png, on the way to a picture.
show() {
  shown=$1.png
  shift
  "$program" render "$@" -o show.exr --preview "$shown" --quiet --aov none
}

# keep PICTURE: what was made is now in docs/pictures.
keep() { cp "$1" "$docs/pictures/$1" && echo "$1"; }

# tiles PICTURE COLUMNSxROWS FILE ...
tiles() {
  picture=$1 grid=$2
  shift 2
  oiiotool "$@" "--mosaic$padding" "$grid" --quality 88 -o "$picture"
  keep "$picture"
}

picture() { [ -z "$wanted" ] || case " $wanted " in *" $1 "*) ;; *) return 1 ;; esac; }

if picture tutorial_01; then
  grow cloud.vdb cloud $base --resolution 480 $usual --billow 0.7
  show tutorial_01 cloud.vdb --size 960x540
  keep tutorial_01.png
fi

if picture silver_lining; then
  grow cloud.vdb cloud $base --resolution 480 $usual --billow 0.7
  show silver_lining cloud.vdb --size 960x540 --sun 195,14,9 --phase mie:12 --sky 0.12,0.16,0.24
  keep silver_lining.png
fi

if picture clear_sky; then
  grow hare.vdb cloud $hare --layers 3 --billow 1
  files=
  for sun in "60 0" "38 0" "15 0.5" "5 2" "1 3.5" "-4 7"; do
    elevation=${sun% *}
    show "clear_sky_$elevation" hare.vdb --backdrop --size 480x270 --view 25,3 --sun "130,$elevation" --sky clear --exposure "${sun#* }"
    files="$files clear_sky_$elevation.png"
  done
  padding="" tiles clear_sky.jpg 3x2 $files
fi

if picture scale; then
  grow congestus.vdb cloud --species congestus
  files=
  for scale in 300m 1km 5km 20km; do
    show "scale_$scale" congestus.vdb --scale "$scale" --aerial-perspective --size 480x270
    files="$files scale_$scale.png"
  done
  padding="" tiles scale.jpg 2x2 $files
fi

# Ten looks in the morning, at noon and in the evening; what they say of the sun gives way.
if picture looks_day; then
  files=
  for look in humilis congestus towering storm overcast sunset silver-lining smoke explosion wisps; do
    verb=cloud
    [ $look != wisps ] || verb=wisps
    grow "look_$look.vdb" $verb --look "$look"
    for sun in "100,12 1" "140,62 0" "85,3 2.5"; do
      exposure=${sun#* }
      # Their own sky is as bright at any time, and so is fire.
      case $look in storm | overcast | explosion) exposure=0 ;; esac
      show "look_${look}_${sun%% *}" "look_$look.vdb" --look "$look" --sun "${sun% *}" --exposure "$exposure" --size 384x216
      files="$files look_${look}_${sun%% *}.png"
    done
  done
  padding="" tiles looks_day.jpg 3x10 $files
fi

if picture looks; then
  files=
  for look in humilis congestus towering storm overcast sunset silver-lining smoke explosion wisps; do
    verb=cloud
    [ $look != wisps ] || verb=wisps
    grow "look_$look.vdb" $verb --look "$look"
    show "look_$look" "look_$look.vdb" --look "$look" --size 480x270
    [ $look = wisps ] || files="$files look_$look.png"
    # The viewer shows them, too.
    oiiotool "look_$look.png" --resize 240x135 --quality 82 -o "$docs/../apps/look/page/look/$look.jpg"
  done
  padding="" tiles looks.jpg 3x3 $files
fi

if picture wedge; then
  "$program" cloud $base -o wedge.vdb --resolution 240 $usual --wedge billow=0,1 --wedge amplitude=1%,2.5%,5% --contact-sheet wedge.png --quiet
  oiiotool wedge.png --resize 1280x0 --quality 88 -o wedge.jpg
  keep wedge.jpg
fi

if picture hare; then
  grow hare.vdb cloud $hare --layers 3 --billow 1
  show hare hare.vdb --size 960x720
  keep hare.png
fi

if picture tutorial_02; then
  grow cloud.vdb cloud $base --resolution 480 $usual --billow 0.7
  show once cloud.vdb --size 480x270 --octaves 1
  show many cloud.vdb --size 480x270
  show lining cloud.vdb --size 480x270 --sun 195,14,9 --phase mie:12 --sky 0.12,0.16,0.24
  show overcast cloud.vdb --size 480x270 --sun 90,38,0 --exposure 1.2
  padding=:pad=4 tiles tutorial_02.png 2x2 once.png many.png lining.png overcast.png
fi

if picture tutorial_03; then
  grow cloud_300.vdb cloud $base --resolution 300 $usual --billow 0.7
  "$program" turntable cloud_300.vdb -o 'look/cloud.####.exr' --frames 1-12 --size 320x180 --view 25,5 --sun 90,30 --quiet \
    --contact-sheet tutorial_03.png
  keep tutorial_03.png
fi

if picture tutorial_04; then
  grow even.vdb cloud $base --resolution 400 $usual --flat-base 2%,4%
  grow painted.vdb cloud cloud_base_painted.ply --resolution 400 $usual --flat-base 2%,4% \
    --amplitude attribute:amplitude:0.2%,3.2% --billow attribute:billow:0,2
  python3 paint_mesh.py $base growth.ply "growth = brush(0.55, 0.6, 0, 0.9)" >/dev/null
  grow growth.vdb cloud growth.ply --resolution 400 $usual --flat-base 2%,4% --amplitude attribute:growth:0.15%,3.5%
  for name in even painted growth; do show $name $name.vdb --size 480x360 --extinction 100 --backdrop; done
  padding="" tiles tutorial_04.png 3x1 even.png painted.png growth.png
fi

if picture cloud_species; then
  files=
  for species in humilis mediocris congestus; do
    for seed in 0 1 4 5; do
      name=${species}_$seed
      grow $name.vdb cloud --species $species --shape-seed $seed --seed $seed --resolution 224 --frequency 6x --billow 0.8 --edge-thickness 0.6%
      show $name $name.vdb --size 280x220 --view 20,2 --backdrop
      files="$files $name.png"
    done
  done
  padding=:pad=4 tiles cloud_species.png 4x3 $files
fi

if picture advect; then
  grow cloud_400.vdb cloud $base --resolution 400 $usual
  grow medium.vdb advect cloud_400.vdb --method gridless --steps 4 \
    --velocity noise:amplitude=1.2%,frequency=10x,octaves=4,roughness=0.6,seed=3
  grow strong.vdb advect cloud_400.vdb --method gridless --velocity noise:amplitude=5%,frequency=8x,octaves=4,roughness=0.6,seed=3
  for name in none medium strong; do
    volume=$name
    [ $name = none ] && volume=cloud_400
    show advect_$name $volume.vdb --size 640x480 --view 25,8 --extinction 60
    keep advect_$name.png
  done
fi

if picture wisps; then
  grow wisps.vdb wisps --seed 1 --dots 1500000
  show wisps wisps.vdb --size 640x480
  keep wisps.png
  grow wisps_clump_small.vdb wisps --guides 1 --dots 3000000 --seed 5 --clump 0.3
  grow wisps_clump_large.vdb wisps --guides 1 --dots 3000000 --seed 5 --clump 1 --density 10
  options="--shape streak --guides 40 --wisp-size 7% --dots 60000 --clump 0.8 --density 8 --seed 2"
  grow wisps_still.vdb wisps $options
  grow wisps_wind.vdb wisps $options --velocity 0.25,-0.1,0 --shutter -1,0
  grow wisps_curl.vdb wisps $options --velocity curl:amplitude=5%,frequency=2x --shutter -0.5,0.5
  for name in clump_small clump_large; do show wisps_$name wisps_$name.vdb --size 480x400; done
  for name in still wind curl; do show wisps_$name wisps_$name.vdb --size 480x300; done
  for name in clump_small clump_large still wind curl; do keep wisps_$name.png; done
fi

if picture camera; then
  grow cloud.vdb cloud $base --resolution 480 $usual --billow 0.7
  view="--size 420x300 --camera-position 3.1,0.8,1.6 --look-at 0,0.66,0 --fov 40 --sun 100,35"
  show sharp cloud.vdb $view
  show near cloud.vdb $view --lens-radius 0.07 --focus-distance 2.2
  show far cloud.vdb $view --lens-radius 0.07 --focus-distance 4
  show turning cloud.vdb $view --shutter=-0.25,0.25 --volume-motion 0,0,0,0,20,0
  padding=:pad=4 tiles camera.png 2x2 sharp.png near.png far.png turning.png
fi

if picture lights; then
  grow cloud.vdb cloud $base --resolution 480 $usual --billow 0.7
  show lamp cloud.vdb --size 480x360 --sky 0.03,0.05,0.09 --sun moon=-60,50,0.3,0.4,0.6 --point lamp=0.55,0.35,0.75,2.4,1.4,0.6 --phase hg:0.6
  show spot cloud.vdb --size 480x360 --sky 0.03,0.05,0.09 --spot 2.2,2.6,1.2,0,0.5,0,14,6,16 --shadow-multiplier spot=1,0.3,0.05
  show suns cloud.vdb --size 480x360 --sky 0.04,0.06,0.1 --sun key=100,20,3.4,2.2,1.2 --sun fill=-70,30,0.3,0.5,0.9
  padding="" tiles lights.png 3x1 lamp.png spot.png suns.png
fi

if picture outputs; then
  grow cloud_300.vdb cloud $base --resolution 300 $usual --billow 0.7
  "$program" transform sphere_uv.obj -o ball.obj --scale 0.35 --move 1.15,1.1,0.5 --quiet
  view="--size 480x270 --camera-position 1.2,1.2,5.4 --look-at 0.15,0.72,0 --fov 40"
  show object cloud_300.vdb $view --object ball.obj --object-color 0.8,0.5,0.2 --checker 16 --ground
  show holdout cloud_300.vdb $view --holdout-object ball.obj
  "$program" render cloud_300.vdb -o layers.exr $view --aov normal,Z_median --quiet
  oiiotool layers.exr --ch N.X,N.Y,N.Z --mulc 0.5 --addc 0.5 -d uint8 -o normals.png
  # Near is white, 6.6 away and farther black.
  oiiotool layers.exr --ch Z_median,Z_median,Z_median --clamp:max=6.6 --mulc -0.5 --addc 3.3 --clamp:min=0:max=1 -d uint8 -o depth.png
  padding=:pad=4 tiles outputs.png 2x2 object.png normals.png holdout.png depth.png
fi

if picture mesh_decimated; then
  grow hare_surface_300.vdb cloud $hare --resolution 300 --layers 3 --billow 1 --surface hare_300.vdb
  "$program" mesh hare_300.vdb -o hare_all.obj --preview hare_all.png --size 420x420 --quiet
  for faces in 20000 2000; do
    "$program" mesh hare_300.vdb -o hare_$faces.obj --faces $faces --preview hare_$faces.png --size 420x420 --quiet
  done
  grep -c '^f ' hare_all.obj
  padding="" tiles mesh_decimated.png 3x1 hare_all.png hare_20000.png hare_2000.png
fi

if [ -n "${DISNEY:-}" ] && picture detail_4k; then
  grow default.vdb cloud $base
  grow fine.vdb cloud $base --resolution 1024
  grow finest.vdb cloud $base --resolution 2048
  files= crops=
  for volume in default.vdb fine.vdb finest.vdb felt/cumulus_detail.felt "$DISNEY"; do
    name=$(basename "$volume" .vdb)
    view="--view 25,0 --sun 100,35"
    [ "$name" != cumulus_detail.felt ] || view="$view --set mesh=\"$base\""
    show "whole_$name" "$volume" $view --size 480x270
    show "crop_$name" "$volume" $view --size 3840x2160 --crop 940,740,1420,1010
    files="$files whole_$name.png" crops="$crops crop_$name.png"
  done
  padding=:pad=4 tiles detail_4k.jpg 5x2 $files $crops
fi

if picture volumes; then
  grow cloud_300.vdb cloud $base --resolution 300 $usual --billow 0.7
  grow tori.vdb cloud linked_tori_and_cone.obj --resolution 200 --frequency 6x --billow 0.4 --seed 3
  view="--size 420x300 --view 25,8"
  show red cloud_300.vdb $view --extinction 12 --extinction-color 0.35,0.6,1 --sun 200,20,9
  show veil cloud_300.vdb tori.vdb $view --density-scale 0.02,1 --extinction 60 --sun 90,38,6
  show fire cloud_300.vdb tori.vdb $view --density-scale 0.1,0.06 --extinction 60 --temperature-grid none,density \
    --temperature-scale 1750 --emission-scale 0.07 --sun 90,38,0.8 --sky 0.01,0.017,0.03
  show flame tori.vdb $view --density-scale 0.02 --extinction 60 --temperature-grid density --temperature-scale 1800 \
    --emission-scale 0.05 --sun 90,38,0 --sky 0.002,0.003,0.005
  padding="" tiles volumes.png 2x2 red.png veil.png fire.png flame.png
fi

if picture view_transforms; then
  grow cloud_300.vdb cloud $base --resolution 300 $usual --billow 0.7
  grow tori.vdb cloud linked_tori_and_cone.obj --resolution 200 --frequency 6x --billow 0.4 --seed 3
  linings= flames=
  for view in standard filmic agx raw; do
    size="--size 320x228 --view-transform $view"
    show lining_$view cloud_300.vdb $size --sun 195,14,9 --phase mie:12 --sky 0.12,0.16,0.24
    show flame_$view tori.vdb $size --view 25,8 --density-scale 0.02 --extinction 60 --temperature-grid density --temperature-scale 1800 \
      --emission-scale 0.05 --sun 90,38,0 --sky 0.002,0.003,0.005
    linings="$linings lining_$view.png" flames="$flames flame_$view.png"
  done
  padding=:pad=4 tiles view_transforms.jpg 4x2 $linings $flames
fi

if picture recipe; then
  grow recipe.vdb cloud $base --resolution 480 --recipe recipes/cauliflower.toml --flat-base 3%,5%
  show recipe recipe.vdb --size 640x480 --sun 105,36 --extinction 110 --backdrop
  keep recipe.png
fi

if picture cloud; then
  grow base.vdb cloud $base --resolution 400 $usual --layers 1 --amplitude 0
  grow one_layer.vdb cloud $base --resolution 400 $usual --layers 1
  for b in 0 1 2; do grow billow_$b.vdb cloud $base --resolution 400 $usual --billow $b; done
  for name in base one_layer billow_0 billow_1 billow_2; do
    show $name $name.vdb --size 420x300
    keep $name.png
  done
fi

if picture cloud_fields; then
  flat="--resolution 400 $usual --flat-base 2%,4%"
  grow even.vdb cloud $base $flat
  grow height.vdb cloud $base $flat --amplitude height:0=0.2%,0.3=0.4%,0.6=3.2%
  grow facing.vdb cloud $base $flat --amplitude facing:1,0,0:-0.3=0.2%,0.5=3.2%
  grow along.vdb cloud $base --resolution 400 --seed 7 --flat-base 2%,4% --frequency along:1,0,0:0=4x,1=12x
  for name in even height facing along; do show field_$name $name.vdb --size 320x240 --extinction 100 --backdrop; done
  padding="" tiles cloud_fields.png 2x2 field_even.png field_height.png field_facing.png field_along.png
fi

if picture cloud_noises; then
  files=
  for noise in perlin worley worley_difference value gabor fft; do
    grow noise_$noise.vdb cloud --species mediocris --shape-seed 2 --resolution 256 --frequency 6x --layers 3 --billow 0.8 --noise $noise
    show noise_$noise noise_$noise.vdb --size 240x200 --backdrop
    files="$files noise_$noise.png"
  done
  padding="" tiles cloud_noises.png 3x2 $files
fi

if picture cloud_density; then
  shape="--species mediocris --shape-seed 2 --seed 2 --resolution 192 --frequency 6x --billow 0.8"
  thin="--edge-thickness 0.6%"
  grow density_1.vdb cloud $shape $thin --flat-base off
  grow density_2.vdb cloud $shape $thin
  grow density_3.vdb cloud $shape $thin --interior-noise 0.8,12x --height-profile 0:0.3,1:0.3
  grow density_4.vdb cloud $shape --edge-thickness 6% --edge-falloff 2
  grow density_5.vdb cloud $shape $thin --thin-out 0.98,0.3
  grow density_6.vdb cloud $shape --edge-thickness 3% --edge-falloff linear --interior-noise 0.5,10x --thin-out 0.8,0.2
  files=
  for i in 1 2 3 4 5 6; do
    show density_$i density_$i.vdb --size 320x250 --backdrop
    files="$files density_$i.png"
  done
  padding=:pad=4 tiles cloud_density.png 3x2 $files
fi

figure() { show "$1" "$1.vdb" --size 300x300 --view 20,5 --sun 100,30 --backdrop "$2" "$3"; }
layers="--resolution 360 --noise fft --frequency 2x --amplitude 4% --lacunarity 3 --roughness 0.35 --seed 4"

if picture figure_3_2; then
  printf '[[layer]]\namplitude = "5%%"\nfrequency = "3x"\noctaves = 4\noctave_roughness = 0.45\n' >left.toml
  printf '[[layer]]\namplitude = "3.5%%"\nfrequency = "7x"\noctaves = 2\noctave_roughness = 0.3\nseed = 5\n' >right.toml
  for side in left right; do
    grow $side.vdb cloud sphere_uv.obj --resolution 360 --recipe $side.toml
    figure $side --extinction 120
  done
  padding="" tiles figure_3_2.jpg 2x1 left.png right.png
fi

# surface NAME: NAME_surface.vdb as an object in its own cloud, which cannot be seen.
surface() {
  show "$1_surface" "$1.vdb" --size 300x300 --view 20,5 --sun 100,30 --backdrop --density-scale 0.0001 --object "$2.vdb"
}

if picture figure_3_3; then
  grow hare_surface.vdb levelset $hare --resolution 360
  files=
  for n in 1 2 3; do
    grow hare_layers_$n.vdb cloud $hare --surface hare_layers_${n}_surface.vdb --layers $n --billow 0 $layers
    surface hare_layers_$n hare_layers_${n}_surface
    files="$files hare_layers_${n}_surface.png"
  done
  surface hare_layers_3 hare_surface
  mv hare_layers_3_surface.png hare_layers_0_surface.png
  surface hare_layers_3 hare_layers_3_surface
  padding="" tiles figure_3_3.jpg 2x2 hare_layers_0_surface.png $files
fi

if picture figure_3_4 || picture figure_3_5; then
  files= surfaces=
  for b in 0 0.33 0.5 0.67 1 2; do
    grow hare_billow_$b.vdb cloud $hare --surface hare_billow_${b}_surface.vdb --layers 3 --billow $b $layers
    surface hare_billow_$b hare_billow_${b}_surface
    figure hare_billow_$b --extinction 250
    surfaces="$surfaces hare_billow_${b}_surface.png"
    files="$files hare_billow_$b.png"
  done
  padding="" tiles figure_3_4.jpg 3x2 $surfaces
  padding="" tiles figure_3_5.jpg 3x2 $files
fi

if picture figure_3_7; then
  files=
  for a in 0 1 4 8; do
    grow hare_advect_$a.vdb cloud $hare --layers 3 --billow 1 $layers --advect $a%
    figure hare_advect_$a --extinction 100
    files="$files hare_advect_$a.png"
  done
  padding="" tiles figure_3_7.jpg 2x2 $files
fi

if picture figure_3_8; then
  sed -n '/^cat >regions.toml/,/^END/p' "$docs/gallery.md" | sed '1d;$d' >regions.toml
  grow regions.vdb cloud $hare --resolution 420 --seed 4 --recipe regions.toml
  show regions regions.vdb --size 480x480 --view 20,5 --sun 100,30 --extinction 250 --backdrop
  padding="" tiles figure_3_8.jpg 1x1 regions.png
fi

if picture cut; then
  "$program" cut $hare --voronoi 12 --preview cut.png --quiet
  oiiotool cut.png --resize 960x540 --quality 88 -o cut.jpg
  keep cut.jpg
  "$program" cut $hare --random-planes 4 --roughness 1.5% --seed 2 --preview stone.png --quiet
  oiiotool stone.png --resize 960x540 --quality 88 -o tutorial_05_stone.jpg
  keep tutorial_05_stone.jpg
fi

if picture transfer; then
  view="--size 960x480 --quiet --texture $fish.png"
  "$program" levelset $fish.obj -o fish.vdb --quiet
  "$program" mesh fish.vdb -o fish_remesh.obj --faces 20000 --quiet
  "$program" transfer --from $fish.obj --to fish_remesh.obj -o fish_remesh_uv.obj --preview transfer.png $view
  keep transfer.png
  "$program" transfer --from $fish.obj --to examples/whale.obj -o striped_whale.obj --quality best \
    --bake-texture striped_whale.png --bake-size 1024x1024 --preview tutorial_06_whale.png $view
  keep tutorial_06_whale.png
fi

if picture fireball; then
  "$program" render felt/fireball.felt --preview fireball.png --size 960x600 --quiet
  oiiotool fireball.png --quality 90 -o fireball.jpg
  keep fireball.jpg
fi

if picture felt; then
  files=
  for name in cumulus lenticular eruption smoke_ring nebula galaxy; do
    "$program" render felt/$name.felt --preview $name.png --size 640x360 --quiet
    files="$files $name.png"
  done
  padding=:pad=4 tiles felt.jpg 2x3 $files
fi

if picture tutorial_07; then
  for name in first second third; do
    sed -n "/^cat >$name.felt/,/^END/p" "$docs/tutorial_07_cloud_from_a_script.md" | sed '1d;$d' >$name.felt
    show $name $name.felt --size 480x360
  done
  padding="" tiles tutorial_07.jpg 3x1 first.png second.png third.png
fi

# Minutes each, where nothing is sampled.
if picture figure_6_5; then
  files=
  for densities in gridded gridless; do
    for steps in 30 60; do
      show "gases_${densities}_$steps" felt/hot_and_cold.felt --size 240x240 --view 20,3 --set steps=$steps --set densities="\"$densities\""
      files="$files gases_${densities}_$steps.png"
    done
  done
  padding="" tiles figure_6_5.jpg 2x2 $files
fi

if picture figure_6_6; then
  files=
  for steps in 11 29 74 124 200; do
    show slab_$steps felt/figures/slab.felt --size 300x300 --view 25,8 --set cells=80 --set steps=$steps
    files="$files slab_$steps.png"
  done
  padding="" tiles figure_6_6.jpg 5x1 $files
fi

if picture figure_7_2; then
  show spheres_0 felt/figures/spheres.felt --size 320x320 --view 0,0 --set steps=0
  show spheres_map felt/figures/spheres.felt --size 320x320 --view 0,0 --set 'sampled="map"'
  files=spheres_0.png
  for gridded in 60 59 50 0; do
    show spheres_sampled_$gridded felt/figures/spheres.felt --size 320x320 --view 0,0 --set gridded=$gridded
    files="$files spheres_sampled_$gridded.png"
  done
  padding=:pad=4 tiles figure_7_2.jpg 3x2 $files spheres_map.png
fi

if picture hot_and_cold; then
  "$program" render felt/hot_and_cold.felt --preview hot_and_cold.png --size 640x640 --view 20,3 --set cells=120 --set steps=75 --quiet
  oiiotool hot_and_cold.png --quality 90 -o hot_and_cold.jpg
  keep hot_and_cold.jpg
fi
