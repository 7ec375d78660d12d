"""Compare the picture of a canvas with the picture that Matplotlib draws."""

import base64
import io

import numpy as np
from PIL import Image


def pixels(png):
    """Return the pixels of a PNG, shape (rows, columns, 3)."""
    return np.asarray(Image.open(io.BytesIO(png)).convert("RGB"), dtype=int)


def shown(canvas):
    """Return the picture of a canvas of the page, as a PNG."""
    return base64.b64decode(canvas.evaluate("(canvas) => canvas.toDataURL()").split(",")[1])


def check_alike(drawn, want, background):
    """Check that few pixels differ by more than 64.

    Their number must be under 1 % of all pixels, and at most half the number of moving pixels.
    Thin lines cover so few pixels that an empty canvas would pass the first condition.
    """
    drawn, want, background = map(pixels, (drawn, want, background))
    assert drawn.shape == want.shape == background.shape
    off, moves = (np.abs(other - want).max(axis=-1) > 64 for other in (drawn, background))
    assert off.mean() < 0.01
    assert off.sum() <= 0.5 * moves.sum(), off.sum() / moves.sum()
