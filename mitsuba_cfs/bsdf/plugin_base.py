"""Base of the BSDF plugins of a window: frame, reflection and transmission, required methods.

The shape's normal points outdoors (to the file's Front); `up` is the world vector that the file's
up means, north where the pane is level.  A plugin says, for directions in the window frame,

- `values(ctx, known, other, active)`: f [1/sr], its density in place of f when it is sampled, and
  the table entry that it comes from;
- `draw(ctx, known, through, u, point, active)`: another direction, and f, density and entry there;
- `totals(ctx, known, active)`: reflected and transmitted share of `known`, by that density;
- `through(ctx, known, active)`: with `peak`, the directly transmitted share: a separate beam
  (a null component), which `values` and `totals` exclude;
- `through_entry(ctx, known, active)`: the table entry of that beam.

With `angular`, shares at even steps of the cosine of incidence from 0 to 1, that beam is this
function's in place of the data's: `mitsuba_cfs.bsdf.angular.AngularTable.by_cosine`.

f is grey (the luminance).  In variants of colour a plugin may have the `colour` of each entry,
which f is multiplied with; directions are drawn by the grey value.

`known` is the direction that a path has come from.  The light goes along it when paths start at
the camera (`TransportMode.Radiance`) and comes from it when they start at a light.  Sampled are
reflection or transmission in proportion to the totals, then `density` x cos(theta), so that

    pdf = density cos(theta) / total,     weight = f cos(theta) / pdf = total f / density.
"""

from __future__ import annotations

import numpy as np


def window_bsdf():
    """The base class of the plugins, on the active variant's types."""
    import drjit as dr
    import mitsuba as mi

    from mitsuba_cfs.bsdf.traced_klems import cell, gather, table

    flags = mi.BSDFFlags
    TRANSMISSION, REFLECTION = int(flags.GlossyTransmission), int(flags.GlossyReflection)
    NULL = int(flags.Null)

    class WindowBsdf(mi.BSDF):
        def __init__(self, props):
            mi.BSDF.__init__(self, props)
            self.up = mi.Vector3f(props.get("up", mi.ScalarVector3f(0, 0, 1)))
            self.north = mi.Vector3f(0, 1, 0)
            common = mi.BSDFFlags.FrontSide | mi.BSDFFlags.BackSide | mi.BSDFFlags.Anisotropic
            common |= mi.BSDFFlags.NonSymmetric
            self.m_components = [mi.BSDFFlags.GlossyReflection | common, mi.BSDFFlags.GlossyTransmission | common]
            self.m_flags = self.m_components[0] | self.m_components[1]
            self.colour = None  # a `TracedColour`
            self.peak = bool(props.get("peak", False))
            if self.peak:
                sides = mi.BSDFFlags.FrontSide | mi.BSDFFlags.BackSide
                self.m_components = [*self.m_components, mi.BSDFFlags.Null | sides]
                self.m_flags |= self.m_components[2]
            self.angular, self.angles = None, 0
            if "angular" in props:
                if not self.peak:
                    raise ValueError("angular shares are those of the beam: they need `peak`")
                shares = np.array(props["angular"]).ravel()
                self.angular, self.angles = table(shares), len(shares)

        # ---- the window frame, turned about the normal against the shading frame

        def turn(self, si):
            """Cosine and sine of the up vector's angle in the shading frame's plane."""
            level = dr.abs(dr.dot(si.sh_frame.n, self.up)) >= 0.99996
            up = si.to_local(dr.select(level, self.north, self.up))
            scale = dr.rsqrt(dr.maximum(up.x * up.x + up.y * up.y, 1e-20))
            return up.x * scale, up.y * scale

        def to_window(self, v, turn):
            a, b = turn
            return mi.Vector3f(v.x * b - v.y * a, v.x * a + v.y * b, v.z)

        def to_shading(self, v, turn):
            a, b = turn
            return mi.Vector3f(v.x * b + v.y * a, v.y * b - v.x * a, v.z)

        # ---- Mitsuba's contract

        def enabled(self, ctx) -> tuple[bool, bool]:
            """Whether the context asks for reflection, for transmission."""
            return (
                ctx.is_enabled(mi.BSDFFlags.GlossyReflection, 0),
                ctx.is_enabled(mi.BSDFFlags.GlossyTransmission, 1),
            )

        def asked_totals(self, ctx, known, active):
            """Shares reflected, transmitted, straight on, as far as the context asks for them."""
            reflected, transmitted = self.totals(ctx, known, active)
            reflects, transmits = self.enabled(ctx)
            straight = 0.0
            if self.peak and ctx.is_enabled(mi.BSDFFlags.Null, 2):
                straight = self.straight_on(ctx, known, active)
            return reflected if reflects else 0.0, transmitted if transmits else 0.0, straight

        def straight_on(self, ctx, known, active):
            """Share of the beam: the angular one where it is given, else that of the data."""
            if self.angular is None:
                return self.through(ctx, known, active)
            place = dr.clip(dr.abs(known.z), 0, 1) * (self.angles - 1)
            low = cell(place, self.angles - 2)
            a, b = (gather(self.angular, low + k, active) for k in (0, 1))
            return dr.lerp(a, b, place - mi.Float(low))

        def tinted(self, value, entry, si, active):
            """Grey values of table entries as a spectrum, zero where not active."""
            value = dr.select(active, value, 0.0)
            if self.colour is None:
                return mi.Spectrum(value)
            return self.colour.spectrum(value, entry, si, active)

        def eval_pdf(self, ctx, si, wo, active=True):
            turn = self.turn(si)
            known, other = self.to_window(si.wi, turn), self.to_window(wo, turn)
            reflects, transmits = self.enabled(ctx)
            through = known.z * other.z < 0
            active = mi.Mask(active) & (known.z != 0) & (other.z != 0)
            active &= dr.select(through, mi.Mask(transmits), mi.Mask(reflects))
            value, density, entry = self.values(ctx, known, other, active)
            total = sum(self.asked_totals(ctx, known, active))
            cosine = dr.abs(wo.z)
            pdf = dr.select(active & (total > 0), density * cosine / dr.maximum(total, TINY), 0.0)
            return self.tinted(value * cosine, entry, si, active), pdf

        def eval(self, ctx, si, wo, active=True):
            return self.eval_pdf(ctx, si, wo, active)[0]

        def pdf(self, ctx, si, wo, active=True):
            return self.eval_pdf(ctx, si, wo, active)[1]

        def sample(self, ctx, si, sample1, sample2, active=True):
            turn, sample1 = self.turn(si), mi.Float(sample1)
            known = self.to_window(si.wi, turn)
            reflected, transmitted, straight = self.asked_totals(ctx, known, active)
            scattered = reflected + transmitted
            total = scattered + straight
            active = mi.Mask(active) & (known.z != 0) & (total > 0)
            u = sample1 * total
            beam = (u >= scattered) & (straight > 0)
            through = (u >= reflected) & (u < scattered) & (transmitted > 0)
            u = dr.select(through, u - reflected, u) / dr.maximum(dr.select(through, transmitted, reflected), TINY)
            u = dr.clip(u, 0.0, ONE_BELOW)
            other, value, density, entry = self.draw(ctx, known, through, u, sample2, active)

            bs = mi.BSDFSample3f()
            bs.wo = dr.select(beam, -si.wi, self.to_shading(other, turn))
            pdf = dr.select(beam, straight, density * dr.abs(other.z)) / dr.maximum(total, TINY)
            bs.pdf = dr.select(active, pdf, 0.0)
            bs.eta = 1.0
            kind = dr.select(through, mi.UInt32(TRANSMISSION), mi.UInt32(REFLECTION))
            bs.sampled_type = dr.select(beam, mi.UInt32(NULL), kind)
            index = dr.select(through, mi.UInt32(1), mi.UInt32(0))
            bs.sampled_component = dr.select(beam, mi.UInt32(2), index)
            active &= bs.pdf > 0
            weight = total * dr.select(beam, 1.0, value / dr.maximum(density, TINY))
            if self.peak and self.colour is not None:
                entry = dr.select(beam, self.through_entry(ctx, known, active), entry)
            return bs, self.tinted(weight, entry, si, active)

        def traverse(self, callback):
            callback.put("up", self.up, mi.ParamFlags.NonDifferentiable)

    return WindowBsdf


ONE_BELOW = 1.0 - 2.0**-24
TINY = 1e-30  # what divides is at least this: scalar variants raise at a division by zero
