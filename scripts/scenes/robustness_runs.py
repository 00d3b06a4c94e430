"""Piles and robots that scripts/robustness.py runs, and their order."""
import functools

from pile_scenes import pile, pile_name, write


def pile_choices(full):
    """List of (options of pile(), time step [s], duration [s])."""
    if not full:
        chosen = []
        for count, friction, masses, step, overlap, extra in (
                (16, 0.5, 1, 0.002, 0, {}), (16, 2, 1e3, 0.002, 0, {}), (16, 0.5, 1, 0.002, 0.5, {}),
                (16, 2, 1e4, 0.01, 0.5, {}), (16, 0.5, 1, 0.002, 0, {"with_chain": True}), (64, 0.5, 1, 0.002, 0, {}),
                (64, 2, 1e3, 0.01, 0, {}), (64, 0.5, 1, 0.01, 0.5, {}), (64, 0.5, 1, 0.002, 0, {"in_bin": True}),
                (200, 0.5, 1, 0.01, 0, {})):
            chosen.append(({"count": count, "friction": friction, "mass_range": masses, "overlap": overlap, "seed": 0,
                            **extra}, step, 1.0))
        return chosen
    chosen = []
    for count, seeds, duration in ((16, 5, 5.0), (64, 3, 5.0), (200, 1, 5.0), (1000, 1, 3.0)):
        for friction in (0.5, 2):
            for masses in (1, 1e3, 1e4):
                for overlap in (0, 0.5):
                    for seed in range(seeds):
                        for step in (0.002, 0.01):
                            chosen.append(({"count": count, "friction": friction, "mass_range": masses,
                                            "overlap": overlap, "seed": seed}, step, duration))
    for extra in ({"with_chain": True}, {"in_bin": True}):
        for count in (16, 64, 200):
            for masses in (1, 1e3):
                chosen.append(({"count": count, "friction": 0.5, "mass_range": masses, "overlap": 0, "seed": 0, **extra},
                               0.002, 5.0))
    return chosen


def hardness(row):
    """Sort key: likely failures first; piles by size, because a run of 1000 bodies takes as long as all others."""
    if row["kind"] == "pile":
        return (row["seed"] > 0, row["bodies"], -row["mass_range"] * row["friction"], -row["overlap"],
                -row["time_step_s"])
    return (row["inputs"] == "0", row["base"] == "fixed", -row["time_step_s"])


def interleaved(first, second):
    """Interleaves two lists in proportion to their lengths, each in its order."""
    places = [((i + 0.5) / len(part), which, run) for which, part in enumerate((first, second))
              for i, run in enumerate(part)]
    return [run for _, _, run in sorted(places, key=lambda place: place[:2])]


def write_pile(name, options, folder, keep):
    if not (keep and (folder / f"{name}.yaml").exists()):
        write(pile(name, duration=5.0, **options), folder)


def pile_runs(arguments):
    runs, folder = [], arguments.out / "piles"
    for options, step, duration in pile_choices(arguments.full):
        name = pile_name(**options)
        row = {"kind": "pile", "scene": name, "bodies": options["count"], "friction": options["friction"],
               "mass_range": options["mass_range"], "overlap": options["overlap"], "seed": options["seed"],
               "time_step_s": step, "duration_s": duration}
        words = [str(folder / f"{name}.yaml"), "--timestep", f"{step:g}", "--duration", f"{duration:g}"]
        runs.append((row, words, functools.partial(write_pile, name, options, folder, arguments.keep)))
    return runs


def one_a_robot(urdfs, folder):
    """URDF with the shortest name of every folder directly below `folder` (robots/X counts as X)."""
    chosen = {}
    for urdf in urdfs:
        parts = urdf.relative_to(folder).parts
        key = parts[1] if parts[0] == "robots" and len(parts) > 2 else parts[0]
        if key not in chosen or len(urdf.name) < len(chosen[key].name):
            chosen[key] = urdf
    return sorted(chosen.values())


def robot_runs(arguments):
    runs = []
    packages = [text for package in arguments.package for text in ("--package", package)]
    for folder in arguments.robots:
        if not folder.is_dir():
            print(f"Skipped: {folder} is not there", flush=True)
            continue
        urdfs = sorted(folder.rglob("*.urdf"))
        first = one_a_robot(urdfs, folder)
        urdfs = first + [u for u in urdfs if u not in first] if arguments.full else first[::3]
        for urdf in urdfs:
            for base in ("floating", "fixed"):
                for scale in (("0", "1") if arguments.full else ("1",)):
                    for step in (0.0005, 0.002, 0.01)[0 if arguments.full else 1:]:
                        duration = 5.0 if arguments.full else 1.0
                        row = {"kind": "robot", "scene": str(urdf.relative_to(folder)), "base": base, "inputs": scale,
                               "seed": 0, "time_step_s": step, "duration_s": duration}
                        drive = ["--random-inputs", scale, "--seed", "0"] if scale != "0" else []
                        runs.append((row, [str(urdf), "--base", base, "--ground", *packages, *drive, "--timestep",
                                           f"{step:g}", "--duration", f"{duration:g}"], None))
    return runs
