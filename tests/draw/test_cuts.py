"""Places at which a narrow page divides a figure."""

import io

import matplotlib.pyplot as plt
import numpy as np
import pytest
from PIL import Image

from rbcourse.draw.save import as_png, cuts_of


def drawn(columns, **settings):
    fig, axes = plt.subplots(2, columns, figsize=(9, 4), layout="constrained", squeeze=False)
    for ax in axes.flat:
        ax.set_ylabel("a long name", labelpad=20)
        ax.plot([0, 1])
    for name, value in settings.items():
        getattr(fig, name)(value)
    as_png(fig)
    return fig, axes


@pytest.mark.parametrize("columns", [1, 3])
def test_cuts_are_between_the_columns_of_axes_with_their_names(columns):
    fig, axes = drawn(columns)
    cuts = np.array(cuts_of(fig)) * fig.bbox.width
    boxes = [[ax.get_tightbbox() for ax in column] for column in axes.T]
    assert len(cuts) == columns - 1
    for k, cut in enumerate(cuts):
        assert max(box.x1 for box in boxes[k]) < cut < min(box.x0 for box in boxes[k + 1])


def test_a_bar_of_colours_stays_with_its_axes():
    fig, axes = drawn(2)
    fig.colorbar(axes[0, 0].imshow(np.eye(2)), ax=axes[:, 0])
    as_png(fig)
    (cut,) = np.array(cuts_of(fig)) * fig.bbox.width
    assert fig.axes[-1].get_tightbbox().x1 < cut < axes[0, 1].get_tightbbox().x0


def test_shared_numbers_and_titles_are_not_divided():
    fig, axes = drawn(2)
    axes[0, 1].tick_params(labelleft=False)
    assert cuts_of(fig) == []
    fig, _ = drawn(2, suptitle="A title of the whole figure, which is above both columns")
    assert cuts_of(fig) == []


def test_the_picture_keeps_the_cuts():
    fig, _ = drawn(3)
    with Image.open(io.BytesIO(as_png(fig))) as picture:
        found = np.array(picture.info["cuts"].split(), float)
    assert np.abs(found - cuts_of(fig)).max() <= 0.0005 + 1e-12
