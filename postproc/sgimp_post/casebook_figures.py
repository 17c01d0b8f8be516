"""The pictures of a casebook: points coloured by what they are made of, how far they have gone and
how much they were sheared, as stills and as animations."""

from __future__ import annotations

import shutil
import subprocess
from dataclasses import dataclass
from pathlib import Path

import matplotlib
import matplotlib.pyplot as plt
import numpy as np
from PIL import Image

from .casebook_frames import DISPLACEMENT, PLASTIC_STRAIN, point_values
from .ensemble import Geometry
from .member_figures import FIELD_COLOURS, draw_outline
from .style import INK, axis_label, styled

#: Shades are few, as those of fields: frames keep their colours in the 256 of a GIF.
_COLOURS = {
    DISPLACEMENT: matplotlib.colormaps["viridis"].resampled(16),
    PLASTIC_STRAIN: matplotlib.colormaps["plasma"].resampled(16),
}
FRAMES_PER_SECOND = 10
#: How long the last frame of a GIF stays before it begins again, in ms.
_PAUSE = 1500
_DPI = 100
#: Inches: most width of the points and height of a row, what is beside and between them.
_WIDTH, _HEIGHT, _MARGIN, _GAP = 5.6, 2.1, 1.35, 0.16


@dataclass(frozen=True)
class View:
    """What all frames of a case share: limits of x and y in m, quantities with their scales (a row
    each), the body as it was."""

    x: tuple
    y: tuple
    quantities: list
    geometry: Geometry


def shared_view(tracks: list, quantities: list, geometry: Geometry) -> View:
    """Limits that hold all points of all tracks, half a point's spacing beyond their centres."""
    half = 0.5 * (geometry.point_spacing or 0.0)
    (left, bottom), (right, top) = (
        (reduce(track.x[k] for track in tracks), reduce(track.y[k] for track in tracks))
        for k, reduce in ((0, min), (1, max))
    )
    margin = half + 0.01 * max(right - left, top - bottom, 1e-3)
    return View((left - half, right + margin), (bottom - half, top + margin), quantities, geometry)


class _Stage:
    """A row a quantity and a column a state, whose points can be moved on."""

    def __init__(self, view: View, columns: int):
        x, y = view.x, view.y
        room = _WIDTH if columns == 1 else 0.8 * _WIDTH
        scale = min(room / (x[1] - x[0]), _HEIGHT / (y[1] - y[0]))  # inches a metre
        rows = len(view.quantities)
        size = (
            _MARGIN + columns * (scale * (x[1] - x[0]) + _GAP),
            0.75 + rows * (scale * (y[1] - y[0]) + _GAP),
        )
        # Even numbers of pixels, as films have them.
        size = [2 * round(0.5 * _DPI * inches) / _DPI for inches in size]
        self.figure, self.axes = plt.subplots(
            rows, columns, figsize=size, dpi=_DPI, squeeze=False, sharex=True, sharey=True
        )
        self.view, self._clouds = view, []
        # A tenth larger than their spacing, else rounding to pixels leaves gaps between them.
        spacing = 1.1 * 72.0 * scale * (view.geometry.point_spacing or 0.0)
        for line, quantity in zip(self.axes, view.quantities):
            label, factor = axis_label(quantity, 0.5 * (quantity.low + quantity.high))
            norm = matplotlib.colors.Normalize(quantity.low / factor, quantity.high / factor)
            colours = _COLOURS.get(quantity.property, FIELD_COLOURS)
            clouds = [
                axis.scatter(
                    [], [], c=[], cmap=colours, norm=norm, s=max(spacing**2, 0.3),
                    marker="s", lw=0, rasterized=True, plotnonfinite=True,
                )
                for axis in line
            ]  # fmt: skip
            self._clouds.append((quantity, factor, clouds))
            extend = "max" if quantity.low == 0.0 else "both"
            self.figure.colorbar(
                clouds[0], ax=list(line), label=label, extend=extend, pad=0.01, aspect=14
            )
        for axis in self.axes.flat:
            axis.set_aspect("equal")
            axis.grid(False)
            axis.set_xlim(x)
            axis.set_ylim(y)
            draw_outline(axis, view.geometry)
        for axis in self.axes[-1]:
            axis.set_xlabel("x [m]")
        for axis in self.axes[:, 0]:
            axis.set_ylabel("y [m]")

    def show(self, column: int, state, title: str) -> None:
        for quantity, factor, clouds in self._clouds:
            clouds[column].set_offsets(state.position)
            clouds[column].set_array(point_values(state, quantity.property) / factor)
        self.axes[0, column].set_title(title)

    def picture(self) -> Image.Image:
        self.figure.canvas.draw()
        return Image.fromarray(np.asarray(self.figure.canvas.buffer_rgba())[..., :3])

    def mark_front(self, runout: float) -> None:
        """Where the member's runout ends, measured from the initial toe."""
        if self.view.geometry.toe is None:
            return
        for axis in self.axes.flat:
            axis.axvline(self.view.geometry.toe + runout, color=INK, lw=1.0, ls=(0, (4, 2)))


@styled
def still_figure(view: View, states, title: str, runout: float):
    """These states (PointState) side by side, a row a quantity; the dashed line is the front."""
    stage = _Stage(view, len(states))
    for column, state in enumerate(states):
        time = f"t = {state.time:.2f} s"
        stage.show(column, state, f"{title}, {time}" if column == 0 else time)
    stage.mark_front(runout)
    return stage.figure


@styled
def animate(view: View, states, times, title: str, runout: float, path: Path) -> list:
    """Writes `path`.gif, and `path`.mp4 if there is an ffmpeg that can, of one state (PointState) a
    time of `times` in s; returns the files. OSError goes through."""
    stage = _Stage(view, 1)
    stage.mark_front(runout)
    digits, pictures = _digits(times), []
    for state, time in zip(states, times):
        stage.show(0, state, f"{title}, t = {time:.{digits}f} s")
        if not pictures:  # what moves is inside the axes: they stay where they are
            stage.figure.canvas.draw()
            stage.figure.set_layout_engine("none")
        pictures.append(stage.picture())
    plt.close(stage.figure)
    files = [path.with_name(path.name + kind) for kind in (".gif", ".mp4")]
    _write_gif(pictures, files[0])
    return files if _write_film(pictures, files[1]) else files[:1]


def _write_gif(pictures, path: Path) -> None:
    """In the 256 most frequent colours of the first frame, exactly; others become the nearest of
    them. (Pillow's own palettes are means, and its nearest is a near one: white is not white.)"""
    colours, _, count = _colours_of(pictures[0])
    # The bars hold all shades: those of one frame serve them all.
    palette = colours[np.argsort(-count, kind="stable")[:256]]
    frames = []
    for picture in pictures:
        colours, index, _ = _colours_of(picture)
        distance = np.square(colours[:, None, :] - palette[None, :, :]).sum(axis=2)
        nearest = distance.argmin(axis=1).astype(np.uint8)
        frame = Image.fromarray(nearest[index].reshape(picture.size[::-1]), mode="P")
        frame.putpalette(np.resize(palette, (256, 3)).astype(np.uint8).tobytes())
        frames.append(frame)
    duration = [1000 // FRAMES_PER_SECOND] * (len(frames) - 1) + [_PAUSE]
    frames[0].save(path, save_all=True, append_images=frames[1:], duration=duration, loop=0)


def _colours_of(picture):
    """The colours of a picture [n, 3], which of them each pixel has, how many pixels have each."""
    rgb = np.asarray(picture).reshape(-1, 3).astype(np.int64)
    code, index, count = np.unique(rgb @ [65536, 256, 1], return_inverse=True, return_counts=True)
    return np.column_stack([code >> 16, code >> 8 & 255, code & 255]), index.reshape(-1), count


def _write_film(pictures, path: Path) -> bool:
    """False without an ffmpeg that writes H.264. (matplotlib's FFMpegWriter would draw each frame a
    second time.)"""
    program = shutil.which("ffmpeg")
    if program is None:
        return False
    size = "{}x{}".format(*pictures[0].size)
    command = [program, "-y", "-loglevel", "error", "-f", "rawvideo", "-pix_fmt", "rgb24"]
    command += ["-s", size, "-framerate", str(FRAMES_PER_SECOND), "-i", "pipe:"]
    # The form of colours that browsers play.
    command += ["-vcodec", "h264", "-pix_fmt", "yuv420p", str(path)]
    frames = b"".join(picture.tobytes() for picture in pictures)
    done = subprocess.run(command, input=frames, capture_output=True)
    if done.returncode != 0:
        path.unlink(missing_ok=True)
    return done.returncode == 0


def _digits(times) -> int:
    """Decimals that tell the times apart, two at least."""
    step = float(np.min(np.diff(times), initial=1.0))
    return 2 if step <= 0.0 else max(2, int(np.ceil(-np.log10(step))) + 1)
