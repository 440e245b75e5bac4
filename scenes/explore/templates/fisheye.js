// What the pixels of a fisheye look at: directions, solid angles, position indices, in scan order
// (x * height + y, y = 0 at the bottom), as mitsuba_cfs/images/view.py and glare/ have them.
(() => {
  "use strict";
  const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
  const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
  const unit = (a) => { const l = Math.hypot(...a) || 1; return a.map((v) => v / l); };

  // Parts of the ray along right, up and forward at picture coordinates from the middle; null: none
  const projections = {
    angular(view, x, y) {
      x *= view.horizontal / 180;
      y *= view.vertical / 180;
      const halfTurns = Math.sqrt(x * x + y * y);
      if (halfTurns > 1) return null;
      const forward = Math.cos(Math.PI * halfTurns);
      const scale = halfTurns > 1e-6 ? Math.sqrt(1 - forward * forward) / halfTurns : Math.PI;
      return [x * scale, y * scale, forward];
    },
    hemispherical(view, x, y) {
      const sine = (angle) => 2 * Math.min(Math.sin(angle * Math.PI / 360), 1 - 2 ** -53);
      const a = x * sine(view.horizontal), b = y * sine(view.vertical), square = a * a + b * b;
      return square > 1 ? null : [a, b, Math.sqrt(Math.max(1 - square, 0))];
    },
  };

  class Fisheye {
    // view: kind, direction, up, horizontal and vertical [deg], width, height; pixels: those that
    // show something; blind: bits of the pixels that are not near themselves (rounding of the dot
    // product, see glare/scan.py)
    constructor(view, pixels, blind) {
      Object.assign(this, { view, pixels, width: view.width, height: view.height });
      const { width: nx, height: ny } = view, n = nx * ny;
      const forward = unit(view.direction), right = unit(cross(forward, view.up));
      this.frame = { forward, right, up: cross(right, forward) };
      this.project = projections[view.kind];
      this.directions = new Float64Array(3 * n);
      this.omega = new Float64Array(n);
      this.projected = new Float64Array(n);
      this.valid = new Uint8Array(n);
      this.blind = new Uint8Array(n);
      this.scan = new Int32Array(pixels.length); // scan place of each pixel
      const angles = this.solidAngles();
      for (let i = 0; i < pixels.length; i++) {
        const row = Math.floor(pixels[i] / nx), x = pixels[i] % nx, place = x * ny + ny - 1 - row;
        const way = this.wayAt((x + 0.5) / nx, 1 - (row + 0.5) / ny);
        this.scan[i] = place;
        this.directions.set(way, 3 * place);
        const omega = angles[pixels[i]];
        this.valid[place] = omega > 0 ? 1 : 0;
        this.omega[place] = omega;
        this.projected[place] = omega * dot(way, forward);
        this.blind[place] = blind[i >> 3] >> (i & 7) & 1;
      }
      this.total = this.omega.reduce((a, b) => a + b, 0);
    }

    wayAt(x, y) {
      const parts = this.project(this.view, x - 0.5, y - 0.5);
      if (!parts) return null;
      const { right, up, forward } = this.frame;
      return [0, 1, 2].map((k) => parts[0] * right[k] + parts[1] * up[k] + parts[2] * forward[k]);
    }

    // Solid angle [sr] of every pixel, rows from the top: the four angles of its quadrilateral
    solidAngles() {
      const { width: nx, height: ny } = this.view, corners = [];
      for (let j = 0; j <= ny; j++) {
        for (let i = 0; i <= nx; i++) corners.push(this.project(this.view, i / nx - 0.5, 0.5 - j / ny));
      }
      const side = (a, b) => unit(cross(a, b));
      const angle = (a, b) => Math.acos(Math.max(-1, Math.min(1, dot(a, b))));
      const found = new Float64Array(nx * ny);
      for (let j = 0; j < ny; j++) {
        for (let i = 0; i < nx; i++) {
          const at = j * (nx + 1) + i;
          const [a, b, c, d] = [corners[at], corners[at + 1], corners[at + nx + 2], corners[at + nx + 1]];
          if (!a || !b || !c || !d) continue;
          const [top, right, bottom, left] = [side(a, b), side(b, c), side(c, d), side(d, a)];
          const sum = angle(left, top) + angle(top, right) + angle(right, bottom) + angle(bottom, left);
          found[j * nx + i] = Math.max(0, 2 * Math.PI - sum);
        }
      }
      return found;
    }

    // Guth's position index above the line of sight, Iwata's below it, at most 16
    positionIndex(way) {
      const { forward, up } = this.frame, cosine = Math.max(-1, Math.min(1, dot(way, forward)));
      const safe = cosine || 1e-12, across = way.map((v, k) => v / safe - forward[k]);
      const length = Math.hypot(...across), upwards = length > 0 ? dot(across, unit(this.view.up)) / length : 0;
      const sigma = Math.acos(cosine), tau = Math.acos(Math.max(-1, Math.min(1, upwards)));
      if (dot(way, up) < 0) {
        const beta = Math.atan(Math.tan(sigma) * Math.sqrt(1 + 0.3225 * Math.cos(tau) ** 2)) * 180 / Math.PI;
        return Math.min(16, Math.exp(6.49e-3 * beta + 21e-5 * beta * beta));
      }
      const s = sigma * 180 / Math.PI, t = tau * 180 / Math.PI;
      const linear = 35.2 - 0.31889 * t - 1.22 * Math.exp(-2 * t / 9);
      const square = 21 + 0.26667 * t - 0.002963 * t * t;
      return Math.min(16, Math.exp(linear * 1e-3 * s + square * 1e-5 * s * s));
    }

    directionOf(place) { return Array.from(this.directions.subarray(3 * place, 3 * place + 3)); }

    // The valid pixel nearest to a direction, as scan place
    placeOf(way) {
      let best = 0, most = -2;
      for (const place of this.scan) {
        if (!this.valid[place]) continue;
        const d = this.directions, at = 3 * place;
        const cosine = d[at] * way[0] + d[at + 1] * way[1] + d[at + 2] * way[2];
        if (cosine > most) { most = cosine; best = place; }
      }
      return best;
    }

    // A search radius [rad] in pixels, as evalglare estimates it at the centre
    pixelsIn(radius) {
      const nx = this.width, ny = this.height, x = nx >> 1, y = ny >> 1;
      const other = Math.min(x + 10, nx - 1) * ny + Math.min(y + 10, ny - 1);
      const cosine = dot(this.directionOf(x * ny + y), this.directionOf(other));
      const distance = Math.acos(Math.max(-1, Math.min(1, cosine)));
      return distance > 0 ? radius / (2 * distance / 10) : 0;
    }

    // Pixels in either direction beyond which nothing is within a radius [rad] of a pixel
    reach(radius) {
      const { view } = this, half = (angle) => angle * Math.PI / 360, longest = Math.max(this.width, this.height);
      let perRadian, stretch = 1;
      if (view.kind === "hemispherical") {
        perRadian = Math.max(this.width / (2 * Math.sin(half(view.horizontal))), this.height / (2 * Math.sin(half(view.vertical))));
      } else {
        const widest = Math.PI / 2 + radius;
        perRadian = Math.max(this.width / (2 * half(view.horizontal)), this.height / (2 * half(view.vertical)));
        stretch = widest / Math.sin(widest);
      }
      return Math.min(Math.ceil(radius * stretch * perRadian) + 2, longest);
    }
  }
  Object.assign(cfs, { Fisheye, dot, cross, unit });
})();
