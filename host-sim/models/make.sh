#!/bin/sh
# From ray-traced links to the models that fly: data sets, training, quantisation. One run, from the root of the
# repository:
#
#     sh host-sim/models/make.sh [--check] [WORK]
#
# Data sets, flights, models and training curves go to WORK (default out/link-state, 400 MB); float models from there to host-sim/models,
# model files to core/models. With --check nothing is replaced: all seven files are compared, byte by byte, and the run fails
# where one differs. Every step is seeded: the same bytes on every machine and for every number of threads.
set -eu
# The order of the files is that of the samples.
export LC_ALL=C
check=
if [ "${1:-}" = --check ]; then
    check=yes
    shift
fi
work=${1:-out/link-state}
cargo build --locked --release -p cslam-host-sim
cslam=${CARGO_TARGET_DIR:-target}/release/cslam
made=$work/models
mkdir -p "$made"
links() { # scene, set, rate, further options
    scene=$1 set=$2 rate=$3
    shift 3
    "$cslam" dataset --scene "$scene" --set "$set" --rate "$rate" --out "$work/$set-$scene$material" "$@"
}

# Geometric networks: a permittivity of its own for every link; many cities and floors, so that none is learnt by heart.
material=
# None of them is flown to report (tests/seeds.toml).
for city in 101 102 103 104 105 106 107 108 109 110 111 112; do
    links "city:$city" train 0.006 --permittivity 2,20
done
# Cities of their own decide when to stop and what the temperature is: a network is surer where it was trained.
for city in 201 202 203; do
    links "city:$city" validation 0.008 --permittivity 2,20
done
for floor in 1 2 3 4 5 6; do
    links "indoor:$floor" train 0.35 --permittivity 2,20
    links "indoor:$floor" validation 0.05 --permittivity 2,20
done
for aod in "" "-without-departure"; do
    "$cslam" train --kind geometric ${aod:+--no-aod} --seed 1 \
        --train "$work"/train-city:* "$work"/train-indoor:* \
        --validation "$work"/validation-city:* "$work"/validation-indoor:* \
        --out "$made/geometric$aod.safetensors"
done

# The paper's network in the paper's world: one scene, one material. It is the scene of reported flights too, as the paper's own figures
# are of the scene that it was trained in; the network of our methods has none of that.
material=-paper
links outdoor train 0.09
links outdoor validation 0.01
"$cslam" train --kind paper --k 9 --seed 1 --any-scene \
    --train "$work/train-outdoor-paper" --validation "$work/validation-outdoor-paper" \
    --out "$made/paper-k9.safetensors"

# Trees: what the receiver measured in flights through the same cities and floors, in both worlds; cities of their own for the calibration. The
# receiver that flies asks the geometric networks, so that the samples do not depend on the trees that are to be made.
printf '[receiver]\nlink_state = "geometric"\n' > "$work/flights.toml"
"$cslam" campaign --quiet --out "$work/flights" --keep-paths "$work/kept" --samples "$work/samples" \
    --configs "$work/flights.toml" --world real budget --seeds 1 1 --scenes \
    city:101 city:102 city:103 city:104 city:105 city:106 city:107 city:108 city:109 city:110 city:111 city:112 \
    indoor:1 indoor:2 indoor:3 indoor:4 indoor:5 indoor:6 city:201 city:202 city:203 > "$work/flights.out"
"$cslam" train --kind trees \
    --train "$work"/samples/*.best.city-1* "$work"/samples/*.best.indoor-* --validation "$work"/samples/*.best.city-2* \
    --out "$made/trees.lscn"

for model in geometric geometric-without-departure; do
    "$cslam" quantize "$made/$model.safetensors" --out "$made/$model.lscn" \
        --calibration "$work"/validation-city:* "$work"/validation-indoor:*
done
"$cslam" quantize "$made/paper-k9.safetensors" --out "$made/paper-k9.lscn" \
    --calibration "$work/validation-outdoor-paper"

differ=
keep() { # made file, its place
    if [ -z "$check" ]; then
        cp "$1" "$2"
    elif cmp "$1" "$2"; then
        echo "$2: the recipe's bytes"
    else
        differ=yes
    fi
}
for model in geometric geometric-without-departure paper-k9; do
    for file in "host-sim/models/$model.safetensors" "core/models/$model.lscn"; do
        keep "$made/${file##*/}" "$file"
    done
done
keep "$made/trees.lscn" core/models/trees.lscn
[ -z "$differ" ]
