"""Writes the files of material points that cases of input/verification read.

Usage: make_points.py DIRECTORY
"""

import sys
from pathlib import Path

import numpy as np


def lattice(x_first, y_first, columns, rows, spacing):
    """Centres of `columns` by `rows` squares, x fastest."""
    x = x_first + spacing * (np.arange(columns) + 0.5)
    y = y_first + spacing * (np.arange(rows) + 0.5)
    return np.tile(x, rows), np.repeat(y, columns)


def write(path, x, y, spacing, vx, vy):
    """One line a point; 17 digits give every number back."""
    lines = [
        ",".join(f"{number:.17g}" for number in row)
        for row in zip(x, y, np.full_like(x, spacing), np.full_like(x, spacing), vx, vy, strict=True)
    ]
    path.write_text("\n".join(["x,y,width,height,vx,vy", *lines]) + "\n")


def main():
    """bar.csv: case 8; affine.csv: case 6."""
    directory = Path(sys.argv[1])
    x, y = lattice(0.0, 0.0, 50, 2, 0.5)
    write(directory / "bar.csv", x, y, 0.5, 0.1 * np.sin(np.pi * x / 50.0), np.zeros_like(x))
    x, y = lattice(1.0, 1.0, 16, 16, 0.125)
    write(directory / "affine.csv", x, y, 0.125, 0.3 * x - 0.2 * y + 1.0, 0.5 * x + 0.1 * y - 2.0)


if __name__ == "__main__":
    main()
