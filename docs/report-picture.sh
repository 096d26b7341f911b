#!/usr/bin/env bash
# Makes docs/report.png: the top of the demo's report, seen by a headless Chromium (Debian: apt-get install chromium).
# VICE names a program that is built already (absolute), CHROMIUM another browser.
set -euo pipefail
cd "$(dirname "$0")/.."
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
project=$PWD
# The page names the data set as it was given: run beside it.
if [ -n "${VICE:-}" ]; then
    (cd "$work" && "$VICE" demo --out demo_out --quiet > said)
else
    (cd "$work" && cargo run --release --quiet --manifest-path "$project/Cargo.toml" -- demo --out demo_out --quiet > said)
fi
browser=${CHROMIUM:-chromium}
# A sandbox needs a user of its own, which containers often lack; the page is ours.
"$browser" --headless=new --no-sandbox --disable-gpu --hide-scrollbars --window-size=1380,1750 \
    --virtual-time-budget=4000 --screenshot="$work/report.png" "file://$work/demo_out/report.html" 2> "$work/browser"
mv "$work/report.png" docs/report.png
