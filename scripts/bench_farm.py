#!/usr/bin/env python3
"""Measures the farm on this machine: frames per second against segment size, workers, threads and tree quality;
and the scheduler with up to 1,024 simulated workers.

Writes a CSV table and plots (SVG, PNG) for each experiment and a report.md with all of them. Workers are processes of this
machine. The machine must be idle otherwise. Needs Rust (unless --programs is given) and Python 3.8 or later, and nothing else.

Exit status: 0 measured; 1 failure; 2 wrong use.
"""

import argparse
import os
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
sys.dont_write_bytecode = True
sys.path.insert(0, str(ROOT / "scripts"))

from farm import experiments, report  # noqa: E402  (in the folder of this file)
from farm.runs import Failure, Master  # noqa: E402

SIZES = [1, 2, 4, 6, 8, 12, 16, 24, 32, 48, 64, 128, 256]
# A folder next to that of the project, which may be absent: scenes and models of other published figures.
SHARED = ROOT.parent / "shared"


def first_there(*paths):
    return next((path for path in paths if path.exists()), paths[-1])


def numbers(text):
    """`1,2,4`, from the least to the greatest."""
    found = sorted({int(number) for number in text.split(",")})
    if not found or found[0] < 1:
        raise ValueError
    return found


def arguments():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=ROOT / "target/bench_farm", help="output folder (%(default)s)")
    parser.add_argument("--only", metavar="NAME,...", help=f"experiments to run, of {', '.join(experiments.ALL)}")
    parser.add_argument("--quick", action="store_true", help="few and small frames: tests the script, measures nothing")
    parser.add_argument("--dry-run", action="store_true", help="print the commands without running them")
    parser.add_argument("--programs", type=Path, help="folder of a built rayfarm-master; without it, it is built")
    parser.add_argument("--scene", type=Path, help="scene to render (w1.toml in ../shared/workloads, else models/instances.toml)")
    parser.add_argument("--model", type=Path, help="OBJ file to rotate (a bust in ../shared/models, else models/camera/camera.obj)")
    parser.add_argument("--frames", type=int, help="frames of a run (100)")
    parser.add_argument("--repeats", type=int, help="repeats of each run (3)")
    parser.add_argument("--workers", type=numbers, metavar="N,...", help="numbers of workers (1,2,3,4)")
    parser.add_argument("--threads", type=numbers, metavar="N,...", help="numbers of threads (1,2,3,4, and all cores)")
    parser.add_argument("--simulated", type=numbers, metavar="N,...", help="numbers of simulated workers (1,2,4,...,1024)")
    return parser.parse_args()


def built(given):
    """The program, of this working tree unless a folder of programs is given."""
    if given is None:
        subprocess.run(["cargo", "build", "--release", "--package", "rayfarm-master"], cwd=ROOT, check=True)
        given = Path(os.environ.get("CARGO_TARGET_DIR", ROOT / "target")) / "release"
    program = given.resolve() / "rayfarm-master"
    if not program.is_file():
        raise Failure(f"{program} does not exist; build it with cargo build --release, or name its folder with --programs")
    return program


def bench(options):
    """The parameters of a run: options of the command line, and defaults for those that are absent."""
    cores = os.cpu_count() or 1
    quick = options.quick
    models = ROOT / "models"
    pawn = models / "chess/pawn.obj"
    scene = pawn if quick else first_there(SHARED / "workloads/w1.toml", models / "instances.toml")
    model = pawn if quick else first_there(SHARED / "models/nefertiti.obj", models / "camera/camera.obj")
    # The camera moves, as in interactive use.
    camera = ("--orbit", "36", *(("--size", "160x120") if quick else ()))
    return experiments.Bench(
        master=Master(built(options.programs), options.dry_run),
        folder=options.out.resolve(),
        scene=(options.scene or scene).resolve(),
        model=(options.model or model).resolve(),
        frames=options.frames or (6 if quick else 100),
        turns=12 if quick else 500,
        repeats=options.repeats or (1 if quick else 3),
        sizes=[1, 16, 128] if quick else SIZES,
        workers=options.workers or ([1, 2] if quick else [1, 2, 3, 4]),
        threads=options.threads or ([1, 2] if quick else sorted({1, 2, 3, 4, cores})),
        few_sizes=[16] if quick else [4, 16, 64],
        options=camera,
        cores=cores,
        simulated=options.simulated or ([1, 8] if quick else [2**power for power in range(11)]),
    )


def chosen(only):
    if only is None:
        return experiments.ALL
    names = only.split(",")
    unknown = [name for name in names if name not in experiments.ALL]
    if unknown:
        print(f"bench_farm.py: there is no {unknown[0]}, but {', '.join(experiments.ALL)}", file=sys.stderr)
        sys.exit(2)
    return {name: experiments.ALL[name] for name in names}


def main():
    options = arguments()
    experiments_to_run = chosen(options.only)
    facts = report.machine(ROOT)  # before the measurement loads the machine
    parameters = bench(options)
    parameters.folder.mkdir(parents=True, exist_ok=True)
    sections = []
    for name, experiment in experiments_to_run.items():
        print(f"== {name}", file=sys.stderr)
        sections.append(experiment(parameters))
    if not options.dry_run:
        report.write(parameters.folder / "report.md", parameters, facts, [found for found in sections if found], options.quick)
        print(parameters.folder / "report.md")


if __name__ == "__main__":
    try:
        main()
    except (Failure, subprocess.CalledProcessError) as failure:
        print(f"bench_farm.py: {failure}", file=sys.stderr)
        sys.exit(1)
    except KeyboardInterrupt:
        sys.exit(130)
