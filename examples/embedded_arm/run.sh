#!/usr/bin/env bash
# run.sh BF: generates the lowpass of ../embed for a Cortex-M3, compiles it for bare metal, and runs it in QEMU. Prints
# the bytes of its result in double and in single precision. Exits with 77 when a tool is missing.
set -euo pipefail
bf=$1 source=$(cd "$(dirname "$0")" && pwd)
for tool in arm-none-eabi-gcc qemu-system-arm; do
    command -v $tool >/dev/null || {
        echo "skipped: $tool is missing: scripts/deps test installs it"
        exit 77
    }
done
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
for precision in "" --single; do
    code=$work/code$precision
    "$bf" generate "$source/../embed/lowpass.yaml" -o "$code" --embedded $precision >/dev/null
    objects=()
    for file in "$code"/*.c "$source/main.c"; do
        object=$work/$(basename "$file")$precision.o
        arm-none-eabi-gcc -mcpu=cortex-m3 -mthumb -std=c11 -Os -ffp-contract=off -ffunction-sections \
            -fdata-sections -Wall -Wextra -Werror -I"$code" -c "$file" -o "$object"
        objects+=("$object")
    done
    arm-none-eabi-gcc -mcpu=cortex-m3 -mthumb -nostartfiles -Wl,--gc-sections -T "$source/mps2_an385.ld" \
        "${objects[@]}" -lm -lc -lgcc -o "$work/lowpass.elf"
    timeout 20 qemu-system-arm -M mps2-an385 -nographic -semihosting-config enable=on,target=native \
        -kernel "$work/lowpass.elf" 2>&1
done
