#!/usr/bin/env python3
"""Extracts mujoco_menagerie from a git directory that may lack its largest files, for counterpoint_mjcf_check.

    scripts/models/menagerie.py GIT_DIR FOLDER

Missing files are replaced by boxes and listed in FOLDER/ABSENT.txt. Most of them are visual meshes; replacing a mesh
that defines an inertia or collides would change the robot.
"""
import pathlib
import struct
import subprocess
import sys

WANTED = (".xml", ".obj", ".stl", ".msh", ".png")
HALF = (0.045, 0.0125, 0.0125)  # half sizes of a camera [m]
CORNERS = [tuple((-1, 1)[i >> k & 1] * HALF[k] for k in range(3)) for i in range(8)]
FACES = [(0, 2, 3), (0, 3, 1), (4, 5, 7), (4, 7, 6), (0, 1, 5), (0, 5, 4),
         (2, 6, 7), (2, 7, 3), (0, 4, 6), (0, 6, 2), (1, 3, 7), (1, 7, 5)]


def obj():
    lines = ["v %g %g %g\n" % c for c in CORNERS] + ["f %d %d %d\n" % tuple(i + 1 for i in f) for f in FACES]
    return "".join(lines).encode()


def stl():
    out = b"\0" * 80 + struct.pack("<I", len(FACES))
    for face in FACES:
        out += struct.pack("<3f", 0, 0, 0)
        out += b"".join(struct.pack("<3f", *CORNERS[i]) for i in face) + b"\0\0"
    return out


def main(git_dir, folder):
    git = ["git", "--git-dir=" + git_dir]
    tree = subprocess.run(git + ["ls-tree", "-r", "HEAD"], check=True, capture_output=True, text=True).stdout
    reader = subprocess.Popen(git + ["cat-file", "--batch"], stdin=subprocess.PIPE, stdout=subprocess.PIPE)
    absent = []
    for row in tree.splitlines():
        head, name = row.split("\t")
        if not name.lower().endswith(WANTED):
            continue
        reader.stdin.write((head.split()[2] + "\n").encode())
        reader.stdin.flush()
        answer = reader.stdout.readline().split()
        if answer[-1] == b"missing":
            absent.append(name)
            data = obj() if name.lower().endswith(".obj") else stl()
        else:
            data = reader.stdout.read(int(answer[2]))
            reader.stdout.read(1)
        path = pathlib.Path(folder, name)
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(data)
    pathlib.Path(folder, "ABSENT.txt").write_text("".join(name + "\n" for name in absent))
    print(f"{len(absent)} files are absent; boxes stand in for them")


if __name__ == "__main__":
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    main(*sys.argv[1:])
