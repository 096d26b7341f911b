#!/usr/bin/env bash
# Makes docs/report.png: the top of the demo's report, seen by a headless Chromium (Debian: apt-get install chromium).
# VICE names a program that is built already, CHROMIUM another browser.
set -euo pipefail
cd "$(dirname "$0")/.."
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
if [ -n "${VICE:-}" ]; then
    "$VICE" demo --out "$work/demo_out" --quiet > "$work/said"
else
    cargo run --release --quiet -- demo --out "$work/demo_out" --quiet > "$work/said"
fi
browser=${CHROMIUM:-chromium}
# A sandbox needs a user of its own, which containers often lack; the page is ours.
"$browser" --headless=new --no-sandbox --disable-gpu --hide-scrollbars --window-size=1120,1750 \
    --virtual-time-budget=4000 --screenshot="$work/report.png" "file://$work/demo_out/report.html" 2> "$work/browser"
mv "$work/report.png" docs/report.png
