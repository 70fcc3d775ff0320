"""A window that shows pictures: a pipe to ``ffplay``, which the Debian package ffmpeg brings."""

from __future__ import annotations

import os
import shutil
import subprocess

import numpy as np
from numpy.typing import NDArray

from .errors import input_error


class Window:
    """Shows pictures of one size. Raises InputError where there is no display or no ``ffplay``."""

    def __init__(self, width: int, height: int, fps: int, title: str) -> None:
        if not (os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")):
            raise input_error("render_mode human", "there is no display", 'set DISPLAY, or use render_mode="rgb_array"')
        player = shutil.which("ffplay")
        if player is None:
            raise input_error("render_mode human", "ffplay is not installed", "install the package ffmpeg")
        command = [player, "-loglevel", "quiet", "-window_title", f"feeler: {title}", "-f", "rawvideo", "-pixel_format"]
        command += ["rgb24", "-video_size", f"{width}x{height}", "-framerate", str(fps), "-"]
        self._process = subprocess.Popen(command, stdin=subprocess.PIPE, stderr=subprocess.DEVNULL)

    def show(self, picture: NDArray[np.uint8]) -> None:
        """The next picture (height, width, 3). Nothing happens once the user has closed the window."""
        pipe = self._process.stdin
        if pipe is None or self._process.poll() is not None:
            return
        try:
            pipe.write(picture.tobytes())
            pipe.flush()
        except BrokenPipeError:
            pass

    def close(self) -> None:
        """Ends the player."""
        if self._process.stdin is not None:
            try:
                self._process.stdin.close()
            except BrokenPipeError:
                pass
        self._process.terminate()
        self._process.wait()
