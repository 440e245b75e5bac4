"""Interactions on a tilted pane, for the tests of the plugins."""

from __future__ import annotations

import numpy as np

from mitsuba_cfs.directions import window_frame

UP = (0.2, 0.1, 1.0)


def interaction(wi_local, normal=(0.3, -0.8, 0.2), spin=0.7):
    """A Mitsuba interaction on a tilted pane whose shading tangents are turned at random.

    Also the matrix [3, 3] from the window frame to the shading frame.
    """
    import drjit as dr
    import mitsuba as mi

    frame = window_frame(normal)
    turned = [np.cos(spin) * frame[0] + np.sin(spin) * frame[1]]
    turned.append(np.cross(frame[2], turned[0]))
    si = dr.zeros(mi.SurfaceInteraction3f)
    si.sh_frame = mi.Frame3f()
    si.sh_frame.s, si.sh_frame.t, si.sh_frame.n = map(mi.Vector3f, [*turned, frame[2]])
    si.n = mi.Normal3f(frame[2])
    si.wi = to_mitsuba(wi_local)
    return si, np.stack([*turned, frame[2]]) @ window_frame(normal, UP).T


def to_mitsuba(vectors):
    """Mitsuba's vectors of [3] or [N, 3]."""
    import mitsuba as mi

    vectors = np.asarray(vectors, dtype=float)
    if mi.variant().startswith("scalar"):
        return mi.Vector3f(vectors)
    return mi.Vector3f(np.atleast_2d(vectors).T.astype(np.float32))


def context(mode: str):
    """A BSDF context of transport mode "Radiance" or "Importance"."""
    import mitsuba as mi

    return mi.BSDFContext(getattr(mi.TransportMode, mode))


def random_directions(count, seed):
    """Unit vectors [N, 3] in all directions."""
    vectors = np.random.default_rng(seed).normal(size=(count, 3))
    return vectors / np.linalg.norm(vectors, axis=1, keepdims=True)


def sampled(bsdf, ctx, wi, count, seed):
    """`count` samples of light or view from `wi` [3]: sample, weight, interaction, frame change."""
    import mitsuba as mi

    u = np.random.default_rng(seed).uniform(size=(3, count)).astype(np.float32)
    si, change = interaction(np.tile(wi, (count, 1)))
    sample, weight = bsdf.sample(ctx, si, mi.Float(u[0]), mi.Point2f(u[1:]))
    return sample, np.array(weight).ravel(), si, change
