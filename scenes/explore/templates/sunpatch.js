// Where the sun shines on a level plane of the room, to its true edges: what it reaches through a
// window group, less the shadow of everything opaque that stands above the plane.
(() => {
  "use strict";
  const ABOVE = 0.002; // [m] over the plane: what lies in it casts no shadow on it

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

  // A path of the shadows of all triangles [n * 9] that fall on the canvas; `to` takes metres to its
  // pixels. Each ends with a line to its first point: the time of closePath grows in Chromium with
  // the length of the path, and 20,000 triangles of a house would take seconds.
  function shadows(triangles, sun, z, to, canvas) {
    const path = new Path2D();
    for (let at = 0; at < triangles.length; at += 9) {
      const polygon = shadow(triangles, at, sun, z)?.map(([x, y]) => to(x, y));
      if (!polygon || outside(polygon, canvas)) continue;
      path.moveTo(...polygon[0]);
      for (let i = 1; i < polygon.length; i++) path.lineTo(...polygon[i]);
      path.lineTo(...polygon[0]);
    }
    return path;
  }

  // Whether all points of a polygon lie beyond one and the same edge of the canvas
  function outside(polygon, { width, height }) {
    return polygon.every(([u]) => u < 0) || polygon.every(([u]) => u > width)
      || polygon.every(([, v]) => v < 0) || polygon.every(([, v]) => v > height);
  }

  // Paint what the sun reaches of the room's outline on the plane z; groups: [{triangles, through}]
  function sunPatch(canvas, room, sun, z, to, colour) {
    const pen = canvas.getContext("2d");
    pen.clearRect(0, 0, canvas.width, canvas.height);
    const sunlit = room.groups.filter((group) => group.through > 0);
    if (sun[2] <= 0.01 || !sunlit.length) return;
    for (const group of sunlit) {
      pen.save();
      pen.globalCompositeOperation = "source-over";
      pen.clip(room.outlinePath(to), "evenodd");
      pen.fillStyle = colour;
      pen.fill(shadows(group.triangles, sun, z, to, canvas), "nonzero");
      pen.restore();
    }
    pen.globalCompositeOperation = "destination-out";
    pen.fillStyle = "#000";
    pen.fill(shadows(room.blockers, sun, z, to, canvas), "nonzero");
    pen.globalCompositeOperation = "source-over";
  }
  Object.assign(cfs, { sunPatch, shadow });
})();
