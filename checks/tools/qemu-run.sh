#!/usr/bin/env bash
# Runs an image on an emulated board: `qemu-run.sh MACHINE ELF [ARGUMENT...]`. Cargo calls it as the runner of the thumb
# target. The arguments reach the program by semihosting, its log comes out decoded, its exit code is this script's.
#
# Environment:
#   CSLAM_RING_FILE   file of 16 MiB that becomes the board's PSRAM (mps2-an500), shared with whoever has it open
#   CSLAM_UART1_FILE  file that takes what the board sends on UART1
#   CSLAM_ICOUNT      N: each instruction takes 2^N ns of the board's time, so that its clocks count instructions
#   CSLAM_PLUGIN      plugin of QEMU with its arguments, as its option -plugin takes them
#   CSLAM_TIMEOUT_S   the run is ended after this many seconds with exit code 124 (default 1800)
#
# Exit codes of its own: 127 when a program is missing, 124 on a time-out.
set -euo pipefail

if [ $# -lt 2 ]; then
    echo "usage: qemu-run.sh MACHINE ELF [ARGUMENT...]" >&2
    exit 2
fi
machine=$1
elf=$2
shift 2

need() {
    if ! command -v "$1" >/dev/null; then
        echo "qemu-run.sh: $1 is missing; install it with: $2" >&2
        exit 127
    fi
}
need qemu-system-arm "apt-get install qemu-system-arm (or your system's package of it)"
# Without its decoder a run would look silent and sound.
need defmt-print "cargo install --locked defmt-print"
need timeout "apt-get install coreutils"

# QEMU takes commas in option values doubled.
quote() {
    printf '%s' "${1//,/,,}"
}
semihosting="enable=on,target=native,arg=$(basename "$elf")"
for argument in "$@"; do
    semihosting+=",arg=$(quote "$argument")"
done
options=(-machine "$machine")
if [ -n "${CSLAM_RING_FILE:-}" ]; then
    options=(-object "memory-backend-file,id=psram,size=16M,share=on,mem-path=$(quote "$CSLAM_RING_FILE")"
        -machine "$machine,memory-backend=psram")
fi
if [ -n "${CSLAM_ICOUNT:-}" ]; then
    options+=(-icount "shift=$CSLAM_ICOUNT")
fi
if [ -n "${CSLAM_PLUGIN:-}" ]; then
    options+=(-plugin "$CSLAM_PLUGIN")
fi
uart1=null
if [ -n "${CSLAM_UART1_FILE:-}" ]; then
    uart1="file:$CSLAM_UART1_FILE"
fi

set +e
# In the foreground, so that the emulator stays in the process group of whoever has to end it.
timeout --foreground "${CSLAM_TIMEOUT_S:-1800}" qemu-system-arm "${options[@]}" -display none -monitor none \
    -serial null -serial "$uart1" -semihosting-config "$semihosting" -kernel "$elf" </dev/null |
    defmt-print -e "$elf" stdin
codes=("${PIPESTATUS[@]}")
if [ "${codes[0]}" -eq 0 ] && [ "${codes[1]}" -ne 0 ]; then
    echo "qemu-run.sh: defmt-print could not decode the log (exit code ${codes[1]})" >&2
    exit 1
fi
exit "${codes[0]}"
