// Where the sun shines on a level plane of the room, to its true edges: what it reaches through a
// window group, less the shadow of everything opaque that stands above the plane.
(() => {
  "use strict";
  const ABOVE = 0.002; // [m] over the plane: what lies in it casts no shadow on it
  const FINE = 2; // samples of a shadow across a pixel: its edges are smooth
  const SHADED = 0xff000000; // opaque
  const layer = document.createElement("canvas");
  let west = new Float64Array(0), east = west; // ends of a polygon in each row

  // The part of a triangle above z, as its projection along the sun onto z: a polygon, seen from
  // above always counter-clockwise, so that a path of many has no seams; null where nothing is
  function shadow(triangles, at, sun, z) {
    const low = z + ABOVE, points = [];
    for (let k = 0; k < 3; k++) {
      const a = at + 3 * k, b = at + 3 * ((k + 1) % 3);
      const za = triangles[a + 2], zb = triangles[b + 2];
      if (za >= low) points.push([triangles[a], triangles[a + 1], za]);
      if ((za >= low) !== (zb >= low)) {
        const t = (low - za) / (zb - za);
        points.push([triangles[a] + t * (triangles[b] - triangles[a]), triangles[a + 1] + t * (triangles[b + 1] - triangles[a + 1]), low]);
      }
    }
    if (points.length < 3) return null;
    const flat = points.map(([x, y, height]) => {
      const along = (height - z) / sun[2];
      return [x - along * sun[0], y - along * sun[1]];
    });
    let area = 0;
    flat.forEach(([x, y], i) => { const [u, v] = flat[(i + 1) % flat.length]; area += x * v - u * y; });
    if (Math.abs(area) < 1e-9) return null;
    return area < 0 ? flat.reverse() : flat;
  }

  // A path of the shadows of some triangles [n * 9]; `to` takes metres to pixels. Each ends with a
  // line to its first point: the time of closePath grows in Chromium with the length of the path.
  function shadows(polygons) {
    const path = new Path2D();
    for (const polygon of polygons) {
      polygon.forEach(([u, v], i) => (i ? path.lineTo(u, v) : path.moveTo(u, v)));
      path.lineTo(...polygon[0]);
    }
    return path;
  }

  // Shadows of triangles on the canvas, as polygons of pixels
  function fallen(triangles, sun, z, to) {
    const polygons = [];
    for (let at = 0; at < triangles.length; at += 9) {
      const polygon = shadow(triangles, at, sun, z);
      if (polygon) polygons.push(polygon.map(([x, y]) => to(x, y)));
    }
    return polygons;
  }

  // The pixels [left, top, width, height] of the canvas that polygons may reach; null: none
  function boxOf(polygons, canvas) {
    const points = polygons.flat(), us = points.map(([u]) => u), vs = points.map(([, v]) => v);
    const left = Math.max(Math.floor(Math.min(...us)), 0), right = Math.min(Math.ceil(Math.max(...us)), canvas.width);
    const top = Math.max(Math.floor(Math.min(...vs)), 0), bottom = Math.min(Math.ceil(Math.max(...vs)), canvas.height);
    return right > left && bottom > top ? [left, top, right - left, bottom - top] : null;
  }

  // Mark the samples of a mask [height * width] whose middle is in a convex polygon (u and v in turn)
  function mark(mask, width, height, polygon, count) {
    let low = Infinity, high = -Infinity;
    for (let i = 0; i < count; i++) { const v = polygon[2 * i + 1]; if (v < low) low = v; if (v > high) high = v; }
    const first = Math.max(Math.ceil(low - 0.5), 0), last = Math.min(Math.floor(high - 0.5), height - 1);
    if (last < first) return;
    if (west.length < height) [west, east] = [new Float64Array(height), new Float64Array(height)];
    for (let row = first; row <= last; row++) { west[row] = Infinity; east[row] = -Infinity; }
    for (let i = 0, j = count - 1; i < count; j = i++) {
      const up = polygon[2 * j + 1] < polygon[2 * i + 1], a = 2 * (up ? j : i), b = 2 * (up ? i : j);
      const u = polygon[a], v = polygon[a + 1], slope = (polygon[b] - u) / (polygon[b + 1] - v);
      const start = Math.max(Math.ceil(v - 0.5), first), end = Math.min(Math.floor(polygon[b + 1] - 0.5), last);
      if (!Number.isFinite(slope)) continue; // level: the edges beside it have its ends
      for (let row = start, at = u + (start + 0.5 - v) * slope; row <= end; row++, at += slope) {
        if (at < west[row]) west[row] = at;
        if (at > east[row]) east[row] = at;
      }
    }
    for (let row = first; row <= last; row++) {
      const to = row * width + Math.min(Math.floor(east[row] - 0.5), width - 1);
      for (let at = row * width + Math.max(Math.ceil(west[row] - 0.5), 0); at <= to; at++) mask[at] = SHADED;
    }
  }

  // What blockers shade of a box of the canvas, as an image of FINE samples a pixel. A house has
  // 20,000 triangles: as one path of the canvas they take a tenth of a second, so that only those
  // whose shadow reaches the box are drawn, and by the lines above.
  function shaded(blockers, sun, z, to, [left, top, wide, tall]) {
    const width = wide * FINE, height = tall * FINE, picture = new ImageData(width, height), low = z + ABOVE;
    const mask = new Uint32Array(picture.data.buffer), flat = new Float64Array(8);
    const [u0, v0] = to(0, 0), [ux, vx] = to(1, 0), [uy, vy] = to(0, 1); // `to` is affine
    const set = (i, x, y) => {
      flat[2 * i] = (u0 + (ux - u0) * x + (uy - u0) * y - left) * FINE;
      flat[2 * i + 1] = (v0 + (vx - v0) * x + (vy - v0) * y - top) * FINE;
    };
    for (let at = 0; at < blockers.length; at += 9) {
      const z0 = blockers[at + 2], z1 = blockers[at + 5], z2 = blockers[at + 8];
      if (z0 < low && z1 < low && z2 < low) continue;
      let count = 3;
      if (z0 >= low && z1 >= low && z2 >= low) {
        for (let k = 0; k < 3; k++) {
          const along = (blockers[at + 3 * k + 2] - z) / sun[2];
          set(k, blockers[at + 3 * k] - along * sun[0], blockers[at + 3 * k + 1] - along * sun[1]);
        }
      } else {
        const polygon = shadow(blockers, at, sun, z);
        if (!polygon) continue;
        count = polygon.length;
        polygon.forEach(([x, y], i) => set(i, x, y));
      }
      let least = Infinity, most = -Infinity;
      for (let i = 0; i < count; i++) { const u = flat[2 * i]; if (u < least) least = u; if (u > most) most = u; }
      if (most > 0 && least < width) mark(mask, width, height, flat, count);
    }
    return picture;
  }

  // Paint what the sun reaches of the room's outline on the plane z; groups: [{triangles, through}]
  function sunPatch(canvas, room, sun, z, to, colour) {
    const pen = canvas.getContext("2d");
    pen.clearRect(0, 0, canvas.width, canvas.height);
    const sunlit = room.groups.filter((group) => group.through > 0);
    if (sun[2] <= 0.01 || !sunlit.length) return;
    const polygons = sunlit.flatMap((group) => fallen(group.triangles, sun, z, to)), box = boxOf(polygons, canvas);
    if (!box) return;
    pen.save();
    pen.clip(room.outlinePath(to), "evenodd");
    pen.fillStyle = colour;
    pen.fill(shadows(polygons), "nonzero");
    pen.restore();
    const picture = shaded(room.blockers, sun, z, to, box);
    layer.width = picture.width;
    layer.height = picture.height;
    layer.getContext("2d").putImageData(picture, 0, 0);
    pen.globalCompositeOperation = "destination-out";
    pen.drawImage(layer, ...box);
    pen.globalCompositeOperation = "source-over";
  }
  Object.assign(cfs, { sunPatch, shadow });
})();
