#!/usr/bin/env bash
# Runs the three scenarios of the balancing iCub, draws them, films two, and sums up in demo.json.
#   demo.sh [BF] [FOLDER]     the bf command and where to write; build/bin/bf and build otherwise
# Exits 0 only if the robot stood and every check of every scenario passed.
set -uo pipefail
here=$(cd "$(dirname "$0")" && pwd)
bf=$(realpath "${1:-build/bin/bf}")
out=${2:-build}
mkdir -p "$out/demo" && out=$(cd "$out" && pwd) || exit 1
python=$here/../../.deps/venv/bin/python
[ -x "$python" ] || python=python3
model=$here/balancing.yaml
names=(two_feet push one_foot)
titles=("two feet, the centre of mass follows a sine" "two pushes at the chest" "a step: the right foot is lifted")

rm -f "$out/demo.json" "$out"/demo/*
for i in 0 1 2; do
    name=${names[i]}
    echo "$name: ${titles[i]}"
    "$bf" run "$model" --set scenario=$((i + 1)) --record "$out/demo/$name.mcap" --summary "$out/demo/$name.json"
    [ -s "$out/demo/$name.mcap" ] && "$bf" plot "$out/demo/$name.mcap" -o "$out/demo/$name.png"
done

# film NAME FROM TO SPEED AT: the robot from FROM to TO seconds, and a picture of it at AT.
film() {
    echo "film of $1"
    "$bf" film "$out/demo/$1.mcap" --from "$2" --to "$3" --speed "$4" --fps 15 \
        --width 400 --height 400 -o "$out/demo/$1.mp4" --picture "$out/demo/$1_at_$5s.png" --at "$5"
}
film push 4.5 7.5 1 5.2
film one_foot 1 19 4 8

"$python" - "$bf" "$model" "$out" "${names[@]}" <<'PYTHON'
import json, pathlib, sys

bf, model, out, names = *sys.argv[1:3], pathlib.Path(sys.argv[3]), sys.argv[4:]
scenarios = {}
for name in names:
    file = out / "demo" / f"{name}.json"
    scenarios[name] = json.loads(file.read_text()) if file.exists() else {"checks": {}, "failure": "did not run"}

def total(key):
    return sum(s.get(key, 0) for s in scenarios.values())

failed = [f"{name}: {s['failure']}" for name, s in scenarios.items() if "failure" in s]
failed += [f"{name}: {check.removesuffix('.passed')}" for name, s in scenarios.items()
           for check, value in s["checks"].items() if value is False]
stood = all(s["checks"].get("stood") is True and "failure" not in s for s in scenarios.values())
summary = {
    "simulated_s": total("simulated_s"),
    "wall_s": total("wall_s"),
    "real_time_factor": total("simulated_s") / total("wall_s") if total("wall_s") else 0,
    "steps": total("steps"),
    "checks": {
        "stood": stood,
        "com_rms_error_m": scenarios["two_feet"]["checks"].get("com_rms_error_m"),
        "contact_wrenches_feasible": all(s["checks"].get("contact_wrenches_feasible") is True for s in scenarios.values()),
        "all_passed": stood and not failed,
    },
    "failed": failed,
    "scenarios": scenarios,
}
(out / "demo.json").write_text(json.dumps(summary, indent=2) + "\n")
for text in failed:
    print("failed:", text)
print(f"The robot {'stood' if stood else 'FELL'} through {len(names)} scenarios at {summary['real_time_factor']:.0f} x real time; "
      f"look at {out}/demo/one_foot.mp4, {out}/demo/*.png and {out}/demo.json.")
print(f"See its controller as a diagram, run it and change it in the browser: {bf} edit {model}")
sys.exit(0 if summary["checks"]["all_passed"] else 1)
PYTHON
