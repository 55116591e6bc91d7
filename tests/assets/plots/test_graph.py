"""A motion graph is drawn, of nothing too."""

import base64
import re

import numpy as np

from assets.plots.graph import motion_graph_picture

PNG = b"\x89PNG\r\n\x1a\n"


def png_of(markdown):
    return base64.b64decode(re.search(r"data:image/png;base64,([A-Za-z0-9+/=]+)\)", markdown)[1])


def test_graph_of_nothing_is_drawn():
    assert png_of(motion_graph_picture(np.zeros(0), 2.0, np.zeros(0))).startswith(PNG)
