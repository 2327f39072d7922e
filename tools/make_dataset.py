"""Write a generated dataset: frames with exact truth, for `flightd evaluate` and `train-colour`.

python tools/make_dataset.py out/hard --level hard --count 200 --seed 9000
python tools/make_dataset.py out/small --level perturbed --size 640x360 --colour white
python tools/make_dataset.py out/empty --level hard --layout negative
python tools/make_dataset.py out/rough --level rough --count 60    # the floor of the simulator's rough world
"""

from __future__ import annotations

import argparse
from pathlib import Path

from rich.console import Console
from rich.progress import Progress

from flightd.sim.dataset.generate import LEVEL_NAMES, ROUGH, write_dataset
from flightd.sim.dataset.paint import PAINT_HSV
from flightd.sim.dataset.scenes import LAYOUTS


def size(text: str) -> tuple[int, int]:
    width, _, height = text.partition("x")
    if not (width.isdecimal() and height.isdecimal() and int(width) >= 64 and int(height) >= 64):
        raise argparse.ArgumentTypeError(f"{text!r} is not WIDTHxHEIGHT of at least 64x64")
    return int(width), int(height)


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("folder", type=Path)
    parser.add_argument("--level", choices=LEVEL_NAMES, default="perturbed")
    parser.add_argument("--count", type=int, default=50)
    parser.add_argument("--seed", type=int, default=0, help="seed of the first frame; the others follow")
    parser.add_argument("--size", type=size, default=(1920, 1080), help="WIDTHxHEIGHT (1920x1080)")
    parser.add_argument(
        "--colour", choices=tuple(PAINT_HSV), help="colour of the lines (default: drawn by seed)"
    )
    parser.add_argument("--layout", choices=LAYOUTS, help="arrangement (default: drawn by seed)")
    parser.add_argument("--masks", action="store_true", help="write each frame's paint mask (for training)")
    wanted = parser.parse_args()
    if wanted.level == ROUGH and (wanted.layout or wanted.masks):
        parser.error(
            f"--level {ROUGH} has no --layout and no --masks; leave them out, or choose another level"
        )
    width_px, height_px = wanted.size
    console = Console(stderr=True)
    with Progress(console=console, disable=not console.is_terminal) as progress:
        task = progress.add_task(f"{wanted.level} frames", total=wanted.count)
        write_dataset(
            wanted.folder,
            wanted.level,
            wanted.count,
            wanted.seed,
            width_px,
            height_px,
            colour=wanted.colour,
            layout=wanted.layout,
            masks=wanted.masks,
            advance=lambda: progress.advance(task),
        )
    print(f"{wanted.count} frames in {wanted.folder}")


if __name__ == "__main__":
    main()
