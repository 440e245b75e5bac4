// Luminance as colours: as the eye adapts to it, or as falsecolour; two pictures as their ratio.
(() => {
  "use strict";
  const KEY = 0.18; // middle grey of the tone-mapped picture
  const MOST_RATIO = 8; // end of the difference's scale, to either side

  // Colours of a palette (bytes, 3 a step) for 0..1
  function shade(palette, fraction) {
    const steps = palette.length / 3, at = Math.max(0, Math.min(steps - 1, Math.floor(fraction * steps)));
    return 3 * at;
  }

  // Reinhart et al. (2002), global operator (4): the log-average becomes middle grey
  function toneCurve(values) {
    let sum = 0, count = 0, largest = 0;
    for (const v of values) if (v > largest) largest = v;
    for (const v of values) if (v > 0) { sum += Math.log(Math.max(v, largest * 1e-9)); count++; }
    if (!count) return () => 0;
    const factor = KEY / Math.exp(sum / count), sample = [];
    for (let i = 0; i < values.length; i += 16) if (values[i] > 0) sample.push(factor * values[i]);
    sample.sort((a, b) => a - b);
    const white = Math.max(sample[Math.floor(sample.length * 0.995)] || 1, 1);
    return (v) => { const s = factor * v; return Math.min(s * (1 + s / (white * white)) / (1 + s), 1); };
  }
  const srgb = (v) => 255 * (v <= 0.0031308 ? 12.92 * v : 1.055 * v ** (1 / 2.4) - 0.055);

  // An image [height, width] of the pixels' values; pixels without one stay clear
  function image(view, pixels, colour) {
    const picture = new ImageData(view.width, view.height), out = picture.data;
    for (let i = 0; i < pixels.length; i++) {
      const at = 4 * pixels[i];
      colour(i, out, at);
      out[at + 3] = 255;
    }
    return picture;
  }

  function toneMapped(view, pixels, values, curve) {
    return image(view, pixels, (i, out, at) => { out[at] = out[at + 1] = out[at + 2] = srgb(curve(values[i])); });
  }

  const TINT_STEP = 0.001; // see scenes/explore/folder.py

  // Red, green, blue and melanopic value of a pixel i: luminance of its parts times their tints
  function coloured(found, tints, i, out) {
    const { own, indoors, sky, sun } = tints, beam = found.ofBeam[i], window = found.ofWindow[i];
    const rest = Math.max(found.values[i] - beam - window, 0);
    for (let k = 0; k < 4; k++) out[k] = own[4 * i + k] * TINT_STEP * (rest * indoors[k] + window * sky[k] + beam * sun[k]);
    return out;
  }

  // As the eye adapts to it: the tone-mapped luminance, in its colours
  function trueColour(view, pixels, found, tints, curve) {
    const rgb = new Float64Array(4);
    return image(view, pixels, (i, out, at) => {
      coloured(found, tints, i, rgb);
      const luminance = 0.2126 * rgb[0] + 0.7152 * rgb[1] + 0.0722 * rgb[2], scale = luminance > 0 ? curve(found.values[i]) / luminance : 0;
      // a colour too bright for the screen is mixed with grey of its luminance
      const grey = scale * luminance, most = scale * Math.max(rgb[0], rgb[1], rgb[2]), share = most > 1 ? (1 - grey) / (most - grey) : 1;
      for (let k = 0; k < 3; k++) out[at + k] = srgb(Math.min(Math.max(grey + share * (scale * rgb[k] - grey), 0), 1));
    });
  }

  // Melanopic equivalent daylight luminance of the pixels [cd/m2]
  function melanopic(found, tints) {
    const values = new Float32Array(found.values.length), four = new Float64Array(4);
    for (let i = 0; i < values.length; i++) values[i] = coloured(found, tints, i, four)[3];
    return values;
  }

  function falseColour(view, pixels, values, palette, low, high) {
    const picture = new ImageData(view.width, view.height), out = new Uint32Array(picture.data.buffer);
    const table = tableOf(palette, low, high), bits = new Uint32Array(values.buffer, values.byteOffset, values.length);
    for (let i = 0; i < pixels.length; i++) out[pixels[i]] = table[values[i] > 0 ? bits[i] >>> SHIFT : 0];
    return picture;
  }

  // Colours by the first bits of a float: a logarithm for each pixel would take most of a frame
  const SHIFT = 12; // 0.05 % of a value, where a colour of the palette is 2.7 % wide
  const tables = new Map();
  function tableOf(palette, low, high) {
    const key = `${low} ${high}`;
    if (!tables.has(key)) {
      const bits = new Uint32Array(1), value = new Float32Array(bits.buffer), table = new Uint32Array(1 << (31 - SHIFT));
      const base = Math.log(low), span = Math.log(high / low), bytes = new Uint8Array(table.buffer);
      for (let i = 0; i < table.length; i++) {
        bits[0] = (i << SHIFT) + (1 << (SHIFT - 1)); // the middle of those that share the bits
        const from = shade(palette, (Math.log(Math.max(value[0], low) || low) - base) / span);
        bytes.set([palette[from], palette[from + 1], palette[from + 2], 255], 4 * i);
      }
      tables.set(key, table);
    }
    return tables.get(key);
  }

  // Blue where the second is darker, red where it is brighter, pale where they are alike
  function ratioColour(ratio) {
    const t = Math.max(-1, Math.min(1, Math.log(ratio) / Math.log(MOST_RATIO))), a = Math.abs(t);
    const end = t < 0 ? [33, 102, 172] : [178, 24, 43];
    return end.map((c) => Math.round(247 + (c - 247) * a));
  }
  function difference(view, pixels, one, other) {
    return image(view, pixels, (i, out, at) => {
      const c = ratioColour(Math.max(other[i], 0.1) / Math.max(one[i], 0.1));
      out[at] = c[0]; out[at + 1] = c[1]; out[at + 2] = c[2];
    });
  }

  // Paint the outline of the glare sources: labels in scan order
  function outlines(picture, labels) {
    const { width: nx, height: ny, data } = picture;
    const label = (x, y) => (x < 0 || y < 0 || x >= nx || y >= ny ? 0 : labels[x * ny + ny - 1 - y]);
    for (let y = 0; y < ny; y++) {
      for (let x = 0; x < nx; x++) {
        const own = labels[x * ny + ny - 1 - y];
        if (!own || (label(x + 1, y) === own && label(x - 1, y) === own && label(x, y + 1) === own && label(x, y - 1) === own)) continue;
        const at = 4 * (y * nx + x);
        data[at] = 255; data[at + 1] = 0; data[at + 2] = 144; data[at + 3] = 255;
      }
    }
  }

  function gradient(palette) {
    const stops = [];
    for (let i = 0; i <= 16; i++) { const at = shade(palette, i / 16); stops.push(`rgb(${palette[at]},${palette[at + 1]},${palette[at + 2]})`); }
    return `linear-gradient(90deg,${stops.join(",")})`;
  }
  Object.assign(cfs, { shade, toneCurve, toneMapped, trueColour, melanopic, falseColour, difference, ratioColour, outlines, gradient, MOST_RATIO });
})();
