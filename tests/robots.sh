#!/usr/bin/env bash
# Proves that exported controllers compute the bits of the simulation: with gcc and clang, at every
# level of optimisation, with and without fused multiply-add in hardware; on emulated processors;
# and that the controller of leader selection fits a small microcontroller.
#
# usage: tests/robots.sh [SWARMCTL]; MILLION=1 compares a million robot-steps of each champion of
# the thesis, too, with each compiler and on each processor, and all combinations of compilers and
# levels with fewer steps. This takes hours, of which most are emulated.
set -euo pipefail
cd "$(dirname "$0")/.."
swarmctl=$(realpath "${1:-target/debug/swarmctl}")
out=target/robots
rm -rf "$out"
mkdir -p "$out"
n_tried=0

skip_installable() { printf 'SKIPPED, but can be installed: %s\n' "$*"; }

has() { command -v "$1" >/dev/null; }

# Exports a controller: export_to DIRECTORY CONFIG GENOTYPE [OPTION...]
export_to() {
    local to=$out/$1 config=$2 genotype=$3
    shift 3
    "$swarmctl" export-controller --config "configs/$config.json" --genotype "$genotype" --to "$to" "$@" |
        head -n 1
}

# Compiles a controller without a warning, and compares its bits: compare DIRECTORY ARGUMENT...
compare() {
    local directory=$1 text
    shift
    text=$(make -s -C "$out/$directory" clean test "$@" 2>&1) || true
    printf '%s: %s: %s\n' "$directory" "$*" "$text"
    [[ $text == *' robot-steps, 0 bits differ' ]] && [[ $text != *$'\n'* ]] || exit 1
    n_tried=$((n_tried + 1))
}

# Compares a controller on 32-bit ARM with fused multiply-add, and on 64-bit ARM, both emulated:
# on_emulated_processors DIRECTORY
on_emulated_processors() {
    if has arm-linux-gnueabihf-gcc && has qemu-arm-static; then
        compare "$1" CC=arm-linux-gnueabihf-gcc RUN=qemu-arm-static \
            'CFLAGS=-O2 -static -mfpu=vfpv4 -Werror'
    else
        skip_installable "exported controllers are not tried on 32-bit ARM: no" \
            "arm-linux-gnueabihf-gcc and qemu-arm-static"
    fi
    if has aarch64-linux-gnu-gcc && has qemu-aarch64-static; then
        compare "$1" CC=aarch64-linux-gnu-gcc RUN=qemu-aarch64-static 'CFLAGS=-O2 -static -Werror'
    else
        skip_installable "exported controllers are not tried on 64-bit ARM: no aarch64-linux-gnu-gcc" \
            "and qemu-aarch64-static"
    fi
}

champions=(leader_selection_snes borderline_snes light_follower_snes orientation_consensus_snes)
n_trials=(334 167 100 167) # A million robot-steps each.
for index in "${!champions[@]}"; do
    name=${champions[index]}
    export_to "$name" "$name" "results/champions/$name-0.json"
done
spiking=light_follower_lif_encoded
export_to $spiking spiking/$spiking results/champions/$spiking-0.json
# Few robots and steps, for slow emulators.
python3 -c 'print([n * 37 % 101 / 100 for n in range(424)])' >"$out/genes.json"
export_to small quickstart "$out/genes.json"

of_this_machine=(-O0 -O1 -O2 -O3)
if [[ $(uname -m) == x86_64 ]]; then
    fused=(-mno-fma)
    if grep -qw fma /proc/cpuinfo; then fused+=(-mfma); fi
else
    fused=('')
fi
for compiler in gcc clang; do
    if ! has $compiler; then
        skip_installable "exported controllers are not compiled with $compiler: it is missing"
        continue
    fi
    for level in "${of_this_machine[@]}"; do
        for fma in "${fused[@]}"; do
            compare leader_selection_snes CC=$compiler "CFLAGS=$level $fma -Werror"
        done
    done
    compare $spiking CC=$compiler "CFLAGS=-O2 -Werror"
done
if [[ ${MILLION:-} ]]; then
    for name in "${champions[@]}" $spiking; do
        for compiler in gcc clang; do
            for level in "${of_this_machine[@]}"; do
                for fma in "${fused[@]}"; do
                    compare "$name" CC=$compiler "CFLAGS=$level $fma -Werror"
                done
            done
        done
    done
    for index in "${!champions[@]}"; do
        name=${champions[index]} large=million-$name
        export_to "$large" "$name" "results/champions/$name-0.json" --trials "${n_trials[index]}"
        for fma in "${fused[@]}"; do
            compare "$large" CC=gcc "CFLAGS=-O2 $fma -Werror"
            compare "$large" CC=clang "CFLAGS=-O2 $fma -Werror"
        done
        on_emulated_processors "$large"
        rm -r "${out:?}/$large"
    done
fi

on_emulated_processors leader_selection_snes
if has arm-linux-gnueabihf-gcc && has qemu-arm-static; then
    # Without fused multiply-add, which the library computes.
    compare small CC=arm-linux-gnueabihf-gcc RUN=qemu-arm-static 'CFLAGS=-O2 -static -Werror'
fi

# A Cortex-M4F: everything that a robot needs, linked, without what it does not use.
microcontroller() {
    local name=leader_selection_snes
    local cpu=(-mcpu=cortex-m4 -mthumb -mfpu=fpv4-sp-d16 -mfloat-abi=hard)
    local strict=(-std=c99 -ffp-contract=off -Wall -Wextra -Wconversion -pedantic -Werror)
    local image=$out/microcontroller.elf flash text data bss stack count level
    arm-none-eabi-gcc "${cpu[@]}" "${strict[@]}" -Os -fstack-usage -ffunction-sections -fdata-sections \
        --specs=nosys.specs -nostartfiles -Wl,--gc-sections -Wl,-e,main -I "$out/$name" -o "$image" \
        tests/robots/microcontroller.c "$out/$name/controller.c" "$out/$name/swarm_radio.c" \
        -dumpdir "$out/" -lm
    read -r text data bss _ < <(arm-none-eabi-size "$image" | tail -n 1)
    flash=$((text + data))
    # No function calls itself, so the stack is at most the sum of all frames.
    stack=$(cat "$out"/*.su | awk '{ sum += $2 } END { print sum }')
    printf 'Cortex-M4F: %d bytes of flash; RAM: %d of data, at most %d of stack\n' \
        "$flash" $((data + bss)) "$stack"
    ((flash < 16384 && data + bss + stack < 2048)) || exit 1
    n_tried=$((n_tried + 1))
    if ! has qemu-system-arm; then
        skip_installable "no controller is tried on an emulated Cortex-M4: no qemu-system-arm"
        return
    fi
    # The emulated board has memory at 0 and at 0x20000000.
    local board=(--specs=rdimon.specs "-Wl,--section-start=.vectors=0" "-Wl,-Tdata=0x20000000")
    compare $name CC=arm-none-eabi-gcc RUN="$PWD/tests/robots/mps2" \
        "CFLAGS=-O2 ${cpu[*]} ${board[*]} $PWD/tests/robots/start.S -Werror"
    for level in -Os -O2; do
        arm-none-eabi-gcc "${cpu[@]}" "${strict[@]}" $level "${board[@]}" -DCOUNT -I "$out/$name" \
            -o "$image" tests/robots/{start.S,microcontroller.c} \
            "$out/$name/controller.c" "$out/$name/swarm_radio.c" -lm
        count=$(tests/robots/mps2 "$image")
        printf 'Cortex-M4F: %d instructions per step with %s, radio included\n' "$count" $level
        # 5 ms at 168 MHz, with 4 cycles per instruction.
        ((0 < count && count < 5 * 168000 / 4)) || exit 1
    done
}
if has arm-none-eabi-gcc && [[ -e $(arm-none-eabi-gcc -print-file-name=nosys.specs) ]]; then
    microcontroller
else
    skip_installable "no controller is compiled for a microcontroller: no arm-none-eabi-gcc with newlib"
fi
printf '%d combinations, every bit equal\n' $n_tried
