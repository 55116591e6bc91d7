"""Pictures of the model: drawn, the same twice, and with nothing to draw."""

import base64
import io
import re

import matplotlib.image
import numpy as np

from assets.plots import hmm as hmm_plots
from kernels.hmm.evidence import Evidence
from kernels.hmm.model import Performed, Smoothing, learn
from kernels.hmm.states import States
from kernels.music.drums_and_melody import Hits


def test_pictures_are_drawn_and_the_same_twice():
    states = States(
        np.random.default_rng(0).normal(size=(3, 198)), np.ones(3), np.array([5, 4, 3]), ((2, 0.5), (3, 0.6))
    )
    one, two = (hmm_plots.centroids(states, ["a", "b", "c"]) for _ in range(2))
    assert one == two
    assert "data:image/png" in one
    heard = np.random.default_rng(0).poisson(1.0, (9, 47)).astype(float), np.ones((9, 5))
    smoothing = Smoothing(0.1, (0.1, 0.1), ((0.1, -1.0, -2.0, -3.0),))
    model = learn([Performed(np.arange(9) % 3, heard)], 3, (47, 5), smoothing=smoothing)
    assert "data:image/png" in hmm_plots.model(model, smoothing)
    assert "data:image/png" in hmm_plots.drum_roll(Hits(np.array([0.5]), np.array([36]), np.array([90])))
    assert "data:image/png" in hmm_plots.timeline(np.arange(3.0), np.array([0, 1]), np.arange(3.0))


def test_where_nothing_was_heard_no_drum_looks_probable():
    """An all-black matrix would say that every drum is probable: dark pixels are few."""
    silent = np.zeros((9, 47)), np.zeros((9, 5))
    smoothing = Smoothing(0.1, (100.0, 100.0))
    picture = hmm_plots.model(learn([Performed(np.arange(9) % 3, silent)], 3, (47, 5), smoothing=smoothing), smoothing)
    encoded = re.search(r"base64,([A-Za-z0-9+/=]+)", picture)[1]
    pixels = matplotlib.image.imread(io.BytesIO(base64.b64decode(encoded)))
    assert (pixels[..., :3].max(axis=-1) < 0.2).mean() < 0.1


def test_the_last_motion_is_drawn_to_its_end():
    edge_s, beats_s = np.arange(3.0), np.arange(3.0)
    ends_later = hmm_plots.timeline(np.array([0.0, 1.0, 1.5]), np.array([0, 1]), beats_s)
    assert hmm_plots.timeline(edge_s, np.array([0, 1]), beats_s) != ends_later


def test_nothing_to_draw_is_said():
    none = np.zeros(0)
    assert hmm_plots.drum_roll(Hits(none, none.astype(int), none.astype(int))) == "nothing was heard"
    assert "no motion" in hmm_plots.centroids(States(np.zeros((0, 0)), none, none.astype(int)), [])
    told = hmm_plots.evidence(
        Evidence(np.array([-1.0]), np.array([-2.0]), np.array([-3.0]), np.array([7]), 0.005), ["a"]
    )
    assert "| a | 7 |" in told
