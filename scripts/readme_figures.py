"""Runs README's campaigns and writes their figures between its `measured`, `teach`, `sensor` and `qemu` marks.

    cargo build --release --workspace --examples --bins && cargo xtask build mps2 && python3 scripts/readme_figures.py [BLOCK ...]

Half an hour on two cores. The table of `bench` and that of `seal --ablate` have commands of their own.
"""

import json
import pathlib
import subprocess
import sys

ROOT = pathlib.Path(__file__).parents[1]
TESAKI = ROOT / "target/release/tesaki"

SEALS = [
    "seal --trials 200",
    "seal --start given --trials 100",
    "seal --path arc --trials 100",
    "seal --path straight --trials 100",
    "seal --path corner --trials 100",
    "seal --path straight --speed 0.4 --trials 100",
    "seal --joint vee --trials 100",
    "seal --joint lip --trials 100",
    "seal --surface harsh --trials 100",
    "seal --offset-mm 20 --offset-deg 5 --trials 100",
    "seal --slits 1 --trials 100",
    "seal --latency-ms 40 --trials 100",
]
TEACHINGS = [
    "teach --path panel --speed 0.1 --trials 100",
    "teach --path panel --speed 0.2 --trials 100",
    "teach --path corner --speed 0.1 --trials 100",
    "teach --joint vee --speed 0.1 --trials 40",
    "teach --joint lip --speed 0.1 --trials 40",
    "teach --surface harsh --speed 0.1 --trials 40",
]


def run(command):
    """The JSON of a command; a campaign that missed a bar (status 1) counts, a refused one does not."""
    print(command, file=sys.stderr)
    done = subprocess.run([TESAKI, *command.split(), "--json"], capture_output=True, text=True, cwd=ROOT)
    if done.returncode > 1:
        sys.exit(f"{command}: {done.stderr}")
    return json.loads(done.stdout)


def table(head, rows):
    lines = [head, ["---"] * len(head), *rows]
    return "\n".join("| " + " | ".join(str(cell) for cell in line) + " |" for line in lines)


def kept(score):
    return f"{score['succeeded']} of {score['trials']}"


def measured():
    head = [
        "command",
        "kept every bar",
        "lateral rms mm",
        "99.9 %",
        "max",
        "height max mm",
        "wrong and used",
        "start off mm, °",
        "start refused",
        "bus load max %",
        "× real time",
    ]
    rows = []
    for command in SEALS:
        score = run(command)
        start = f"{score['start_pose_max_mm']:.2f}, {score['start_pose_max_deg']:.2f}"
        if "given" in command:
            start = "given"
        row = [f"`{command}`", kept(score)]
        row += [f"{score[key]:.3f}" for key in ("lateral_rms_mm", "lateral_p999_mm", "lateral_max_mm", "height_max_mm")]
        row += [score["seam_wrong_unflagged"], start, score["start_refused"]]
        row += [f"{score['bus_load_max_percent']:.1f}", f"{score['sim_speed_x']:.0f}"]
        rows.append(row)
    return table(head, rows)


def teach():
    head = ["command", "kept every bar", "taught rms mm", "max", "orientation max °", "lost"]
    rows = []
    for command in TEACHINGS:
        score = run(command)
        figures = [f"{score[key]:.3f}" for key in ("taught_rms_mm", "taught_max_mm")]
        rows.append([f"`{command}`", kept(score), *figures, f"{score['orientation_max_deg']:.2f}", score["seam_lost"]])
    return table(head, rows)


def sensor():
    options = ["--frames", "10000", "--seed", "20261122", "--slits", "2", "--surface", "moderate,harsh"]
    example = ROOT / "target/release/examples/detection"
    print("detection", *options, file=sys.stderr)
    done = subprocess.run([example, *options], capture_output=True, text=True, check=True)
    return "\n".join(line for line in done.stdout.split("\n\n")[0].splitlines() if line.startswith("|"))


def qemu():
    here, there = run("seal"), run("seal --on qemu")
    same = "the same" if here["log_hash"] == there["log_hash"] else "NOT the same"
    return (
        f"`seal --on qemu`, seed 1: {same} hash as in process ({there['log_hash']}), "
        f"{there['sim_speed_x']:.1f} × real time with both images."
    )


def replace(text, block, body):
    begin, end = f"<!-- {block}: begin -->", f"<!-- {block}: end -->"
    before, rest = text.split(begin)
    _, after = rest.split(end)
    return f"{before}{begin}\n{body}\n{end}{after}"


BLOCKS = {"measured": measured, "teach": teach, "sensor": sensor, "qemu": qemu}

for block in sys.argv[1:] or BLOCKS:
    if block not in BLOCKS:
        sys.exit(f"block {block!r}: not one of {', '.join(BLOCKS)}")
    body = BLOCKS[block]()
    readme = ROOT / "README.md"
    readme.write_text(replace(readme.read_text(), block, body))
