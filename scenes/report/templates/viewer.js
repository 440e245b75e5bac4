// The 3D view: WebGL where there is one, else the same picture painted back to front on a canvas.
// `picked` is called with the index of a room that is clicked.
const cfsViewer = (data, picked) => {
  "use strict";
  const canvas = document.getElementById("viewer");
  const byId = (id) => document.getElementById("viewer-" + id);
  const bytes = (text) => Uint8Array.from(atob(text), (c) => c.charCodeAt(0));
  const points = (text) => Float32Array.from(new Int16Array(bytes(text).buffer), (v) => v * data.unit);
  const dark = matchMedia("(prefers-color-scheme: dark)");
  const COLOURS = {
    floor: [0.76, 0.73, 0.68, 1], ceiling: [0.88, 0.88, 0.88, 1], wall: [0.86, 0.85, 0.82, 1],
    door: [0.66, 0.54, 0.42, 1], frame: [0.5, 0.52, 0.55, 1], glass: [0.35, 0.65, 0.95, 0.3],
    furniture: [0.6, 0.55, 0.48, 1], outdoors: [0.55, 0.6, 0.66, 0.1], mark: [0.9, 0.1, 0.1, 1], before: [0.95, 0.45, 0.05, 0.18],
    north: [0.75, 0.15, 0.15, 1],
  };
  const see = { azimuth: -2.2, elevation: 0.62, distance: 1, target: [0, 0, 0], room: -1, layer: 0, storey: -1 };
  let tints = [];  // of rooms, by index: a colour that their floor and walls are mixed with

  // ---- the model as arrays: position and unit normal of each triangle corner
  function normals(p) {
    const n = new Float32Array(p.length);
    for (let i = 0; i < p.length; i += 9) {
      const u = [p[i + 3] - p[i], p[i + 4] - p[i + 1], p[i + 5] - p[i + 2]];
      const v = [p[i + 6] - p[i], p[i + 7] - p[i + 1], p[i + 8] - p[i + 2]];
      const c = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
      const length = Math.hypot(...c) || 1;
      for (let k = 0; k < 9; k++) n[i + k] = c[k % 3] / length;
    }
    return n;
  }
  const batches = data.batches.map((b) => {
    const p = points(b.t);
    return { room: b.room, storey: b.storey, kind: b.kind, p, n: normals(p), e: points(b.e) };
  });
  const corners = points(data.sensors.corners);
  const layers = data.layers.map((layer) => bytes(layer.colours));
  const height = batches.reduce((most, b) => b.p.reduce((m, v, i) => (i % 3 === 2 ? Math.max(m, v) : m), most), 0);

  // ---- the chosen storey: what stands above it, its ceilings too, is lifted or left out
  const isAbove = (storey, kind) => see.storey >= 0
    && (storey > see.storey || (storey === see.storey && kind === "ceiling"));
  const lifted = () => byId("lift")?.checked;
  const rise = (b) => (isAbove(b.storey, b.kind) ? 1.2 * height : 0);
  function sensorBatch(room) {
    const p = [], c = [];
    data.sensors.room.forEach((owner, s) => {
      if (room >= 0 && owner !== room) return;
      const storey = data.sensors.storey[s], up = rise({ storey });
      if (up && !lifted()) return;
      for (const k of [0, 1, 2, 0, 2, 3]) {
        for (let j = 0; j < 3; j++) {
          p.push(corners[s * 12 + k * 3 + j] + (j === 2 ? up : 0));
          c.push(layers[see.layer][s * 3 + j] / 255);
        }
      }
    });
    return { p: new Float32Array(p), c: new Float32Array(c) };
  }
  const shows = { outdoors: () => byId("outdoors").checked, mark: () => true, north: () => true, before: () => byId("before").checked };
  const visible = () => batches.filter((b) => (lifted() || !rise(b)) && (b.room < 0
    ? shows[b.kind]() : see.room < 0 || b.room === see.room));

  // ---- camera
  function fit() {
    const [low, high] = see.room < 0 && see.storey < 0 && byId("outdoors").checked
      ? data.whole.map((corner) => [...corner]) : [[1e9, 1e9, 1e9], [-1e9, -1e9, -1e9]];
    for (const b of batches) {
      if (b.room < 0 || (see.room >= 0 && b.room !== see.room) || (rise(b) && !lifted())) continue;
      const up = [0, 0, rise(b)];
      b.p.forEach((v, i) => {
        const at = v + up[i % 3];
        low[i % 3] = Math.min(low[i % 3], at);
        high[i % 3] = Math.max(high[i % 3], at);
      });
    }
    see.target = low.map((v, i) => (v + high[i]) / 2);
    const { back, right, up } = camera(), aspect = canvas.clientWidth / canvas.clientHeight, tan = Math.tan(0.3);
    see.distance = 1e-3;
    for (let k = 0; k < 8; k++) {
      const c = low.map((v, i) => ((k >> i) & 1 ? high[i] : v) - see.target[i]);
      const [x, y, z] = [right, up, back].map((axis) => Math.abs(axis[0] * c[0] + axis[1] * c[1] + axis[2] * c[2]));
      see.distance = Math.max(see.distance, z + 1.08 * x / tan / aspect, z + 1.08 * y / tan);
    }
  }
  function camera() {
    const [ca, sa, ce, sn] = [Math.cos(see.azimuth), Math.sin(see.azimuth), Math.cos(see.elevation), Math.sin(see.elevation)];
    const back = [ce * ca, ce * sa, sn], right = [-sa, ca, 0], up = [-sn * ca, -sn * sa, ce];
    const eye = see.target.map((v, i) => v + see.distance * back[i]);
    return { back, right, up, eye };
  }
  function matrix() {
    const { back, right, up, eye } = camera();
    const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
    const f = 1 / Math.tan(0.3), aspect = canvas.width / canvas.height;
    const near = see.distance * 0.02, far = see.distance * 40;
    const rows = [
      [...right.map((v) => v * f / aspect), -dot(right, eye) * f / aspect],
      [...up.map((v) => v * f), -dot(up, eye) * f],
      [...back.map((v) => v * (far + near) / (near - far)), -dot(back, eye) * (far + near) / (near - far) + 2 * far * near / (near - far)],
      [...back.map((v) => -v), dot(back, eye)],
    ];
    return rows;
  }
  const shade = (n) => 0.86 + 0.12 * Math.abs(n[2]) + 0.14 * Math.abs(n[0] * 0.6 + n[1] * 0.8);
  const toned = (c) => (dark.matches ? [c[0] * 0.5, c[1] * 0.52, c[2] * 0.56, c[3]] : c);
  const TINTED = { floor: 0.75, wall: 0.4, ceiling: 0.4 };
  const colourOf = (b) => {
    const tint = b.room >= 0 && tints[b.room], share = TINTED[b.kind];
    return toned(tint && share ? [...tint.map((v, i) => share * v + (1 - share) * COLOURS[b.kind][i]), 1] : COLOURS[b.kind]);
  };
  const lineColour = () => (dark.matches ? [0.9, 0.93, 0.97] : [0.12, 0.16, 0.2]);

  // ---- WebGL
  function webgl() {
    const gl = canvas.getContext("webgl", { antialias: true, preserveDrawingBuffer: true });
    if (!gl) return null;
    const compile = (kind, source) => {
      const shader = gl.createShader(kind);
      gl.shaderSource(shader, source);
      gl.compileShader(shader);
      return shader;
    };
    const program = gl.createProgram();
    gl.attachShader(program, compile(gl.VERTEX_SHADER, `
      attribute vec3 position, shading; uniform mat4 view; uniform float shift, up; varying vec3 lit;
      void main() { gl_Position = view * vec4(position.xy, position.z + up, 1.0); gl_Position.z -= shift * gl_Position.w; lit = shading; }`));
    gl.attachShader(program, compile(gl.FRAGMENT_SHADER, `
      precision mediump float; uniform vec4 colour; varying vec3 lit;
      void main() { gl_FragColor = vec4(colour.rgb * lit * colour.a, colour.a); }`));
    gl.linkProgram(program);
    if (!gl.getProgramParameter(program, gl.LINK_STATUS)) return null;
    gl.useProgram(program);
    const at = (name) => gl.getUniformLocation(program, name);
    const view = at("view"), colour = at("colour"), shift = at("shift"), upwards = at("up");
    const places = ["position", "shading"].map((name) => gl.getAttribLocation(program, name));
    const buffer = (array) => {
      const b = gl.createBuffer();
      gl.bindBuffer(gl.ARRAY_BUFFER, b);
      gl.bufferData(gl.ARRAY_BUFFER, array, gl.STATIC_DRAW);
      return b;
    };
    const stored = new Map(batches.map((b) => {
      const lit = b.n.map((_, i) => shade(b.n.subarray(i - i % 3, i - i % 3 + 3)));
      return [b, { p: buffer(b.p), s: buffer(lit), e: buffer(b.e) }];
    }));
    let sensors = null;
    function draw(mode, position, shading, count, rgba, offset, up = 0) {
      gl.bindBuffer(gl.ARRAY_BUFFER, position);
      gl.enableVertexAttribArray(places[0]);
      gl.vertexAttribPointer(places[0], 3, gl.FLOAT, false, 0, 0);
      if (shading) {
        gl.bindBuffer(gl.ARRAY_BUFFER, shading);
        gl.enableVertexAttribArray(places[1]);
        gl.vertexAttribPointer(places[1], 3, gl.FLOAT, false, 0, 0);
      } else {
        gl.disableVertexAttribArray(places[1]);
        gl.vertexAttrib3f(places[1], 1, 1, 1);
      }
      gl.uniform4fv(colour, rgba);
      gl.uniform1f(shift, offset);
      gl.uniform1f(upwards, up);
      gl.drawArrays(mode, 0, count);
    }
    return {
      sensorsChanged() {
        const s = sensorBatch(see.room);
        if (sensors) { gl.deleteBuffer(sensors.p); gl.deleteBuffer(sensors.c); }
        sensors = { p: buffer(s.p), c: buffer(s.c), count: s.p.length / 3 };
      },
      paint() {
        gl.viewport(0, 0, canvas.width, canvas.height);
        gl.clearColor(0, 0, 0, 0);
        gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
        gl.enable(gl.DEPTH_TEST);
        gl.enable(gl.BLEND);
        gl.blendFunc(gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
        const m = matrix();
        gl.uniformMatrix4fv(view, false, new Float32Array([0, 1, 2, 3].flatMap((c) => m.map((r) => r[c]))));
        const shown = visible(), solid = shown.filter((b) => COLOURS[b.kind][3] === 1);
        gl.enable(gl.CULL_FACE);
        gl.cullFace(gl.FRONT);
        for (const b of solid) draw(gl.TRIANGLES, stored.get(b).p, stored.get(b).s, b.p.length / 3, colourOf(b), 0, rise(b));
        gl.disable(gl.CULL_FACE);
        draw(gl.TRIANGLES, sensors.p, sensors.c, sensors.count, [1, 1, 1, 1], 0);
        gl.depthMask(false);
        const ink = lineColour();
        for (const b of shown) {
          const faint = b.room < 0 ? 0.25 : b.kind === "glass" ? 0.6 : 0.55;
          draw(gl.LINES, stored.get(b).e, null, b.e.length / 3, [...ink, faint], 0.0004, rise(b));
        }
        for (const b of shown) if (COLOURS[b.kind][3] < 1) {
          draw(gl.TRIANGLES, stored.get(b).p, stored.get(b).s, b.p.length / 3, COLOURS[b.kind], 0, rise(b));
        }
        gl.depthMask(true);
      },
    };
  }

  // ---- canvas: the painter's algorithm
  function painter() {
    const pen = canvas.getContext("2d");
    let sensors = null;
    const css = (c, k, a) => `rgba(${c.slice(0, 3).map((v, j) => Math.round(Math.min(1, v * (k.length ? k[j] : k)) * 255))},${a})`;
    return {
      sensorsChanged() { sensors = sensorBatch(see.room); },
      paint() {
        pen.clearRect(0, 0, canvas.width, canvas.height);
        const m = matrix(), { eye } = camera();
        const project = (p, i, up) => {
          const [x, y, , w] = m.map((r) => r[0] * p[i] + r[1] * p[i + 1] + r[2] * (p[i + 2] + up) + r[3]);
          return w > see.distance * 0.02 ? [(x / w + 1) / 2 * canvas.width, (1 - y / w) / 2 * canvas.height, w] : null;
        };
        const shapes = [];
        const triangle = (p, i, fill, group, up = 0) => {
          const q = [0, 3, 6].map((k) => project(p, i + k, up));
          if (q.every(Boolean)) shapes.push({ q, fill, depth: q[0][2] + q[1][2] + q[2][2], group });
        };
        const ink = lineColour();
        for (const b of visible()) {
          const c = colourOf(b), up = rise(b);
          for (let i = 0; i < b.p.length; i += 9) {
            const n = b.n.subarray(i, i + 3);
            const facing = n[0] * (eye[0] - b.p[i]) + n[1] * (eye[1] - b.p[i + 1]) + n[2] * (eye[2] - b.p[i + 2] - up);
            if (c[3] === 1 && facing > 0) continue;
            triangle(b.p, i, css(c, shade(n), c[3]), c[3] === 1 ? 0 : 3, up);
          }
          for (let i = 0; i < b.e.length; i += 6) {
            const q = [project(b.e, i, up), project(b.e, i + 3, up)];
            if (q.every(Boolean)) shapes.push({ q, stroke: css(ink, 1, b.room < 0 ? 0.25 : 0.5), depth: 0, group: 1 });
          }
        }
        for (let i = 0; i < sensors.p.length; i += 9) triangle(sensors.p, i, css([1, 1, 1], sensors.c.subarray(i, i + 3), 1), 2);
        shapes.sort((a, b) => a.group - b.group || b.depth - a.depth);
        for (const s of shapes) {
          pen.beginPath();
          s.q.forEach(([x, y], k) => (k ? pen.lineTo(x, y) : pen.moveTo(x, y)));
          if (s.fill) { pen.closePath(); pen.fillStyle = s.fill; pen.fill(); }
          else { pen.strokeStyle = s.stroke; pen.lineWidth = devicePixelRatio; pen.stroke(); }
        }
      },
    };
  }

  // ---- hands
  const renderer = webgl() || painter();
  let waiting = false;
  function repaint() {
    if (waiting) return;
    waiting = true;
    requestAnimationFrame(() => {
      waiting = false;
      const scale = Math.min(devicePixelRatio || 1, 2);
      const width = Math.round(canvas.clientWidth * scale), height = Math.round(canvas.clientHeight * scale);
      if (!width || !height) return;
      if (canvas.width !== width || canvas.height !== height) { canvas.width = width; canvas.height = height; }
      renderer.paint();
      canvas.dataset.painted = "yes";
    });
  }
  function turn(dx, dy) {
    see.azimuth -= dx;
    see.elevation = Math.max(-1.5, Math.min(1.5707, see.elevation + dy));
    repaint();
  }
  const zoom = (factor) => { see.distance *= factor; repaint(); };
  const reset = () => { see.azimuth = -2.2; see.elevation = 0.62; fit(); repaint(); };
  // The nearest room whose drawn surfaces the line through a place of the canvas meets; -1: none
  function roomAt(x, y) {
    const { back, right, up, eye } = camera(), tan = Math.tan(0.3), aspect = canvas.clientWidth / canvas.clientHeight;
    const across = (2 * x / canvas.clientWidth - 1) * tan * aspect, upwards = (1 - 2 * y / canvas.clientHeight) * tan;
    const d = back.map((v, i) => -v + across * right[i] + upwards * up[i]);
    let nearest = Infinity, room = -1;
    for (const b of visible()) {
      if (b.room < 0) continue;
      const lift = rise(b);
      for (let i = 0; i < b.p.length; i += 9) {
        const a = [b.p[i], b.p[i + 1], b.p[i + 2] + lift];
        if (b.kind !== "glass" && b.n[i] * d[0] + b.n[i + 1] * d[1] + b.n[i + 2] * d[2] < 0) continue;
        const u = [0, 1, 2].map((k) => b.p[i + 3 + k] - b.p[i + k]), v = [0, 1, 2].map((k) => b.p[i + 6 + k] - b.p[i + k]);
        const h = [d[1] * v[2] - d[2] * v[1], d[2] * v[0] - d[0] * v[2], d[0] * v[1] - d[1] * v[0]];
        const det = u[0] * h[0] + u[1] * h[1] + u[2] * h[2];
        if (Math.abs(det) < 1e-12) continue;
        const s = eye.map((value, k) => value - a[k]), first = (s[0] * h[0] + s[1] * h[1] + s[2] * h[2]) / det;
        const q = [s[1] * u[2] - s[2] * u[1], s[2] * u[0] - s[0] * u[2], s[0] * u[1] - s[1] * u[0]];
        const second = (d[0] * q[0] + d[1] * q[1] + d[2] * q[2]) / det, t = (v[0] * q[0] + v[1] * q[1] + v[2] * q[2]) / det;
        if (first >= 0 && second >= 0 && first + second <= 1 && t > 0 && t < nearest) { nearest = t; room = b.room; }
      }
    }
    return room;
  }
  let held = null, moved = false;
  canvas.addEventListener("pointerdown", (event) => { held = [event.clientX, event.clientY]; moved = false; canvas.setPointerCapture(event.pointerId); });
  canvas.addEventListener("pointermove", (event) => {
    if (!held || (!moved && Math.hypot(event.clientX - held[0], event.clientY - held[1]) < 4)) return;
    moved = true;
    turn((event.clientX - held[0]) * 0.008, (event.clientY - held[1]) * 0.008);
    held = [event.clientX, event.clientY];
  });
  canvas.addEventListener("pointerup", (event) => {
    if (held && !moved) picked?.(roomAt(event.offsetX, event.offsetY));
    held = null;
  });
  canvas.addEventListener("pointercancel", () => { held = null; });
  canvas.addEventListener("wheel", (event) => {
    if (document.activeElement !== canvas && !event.ctrlKey) return;
    event.preventDefault();
    zoom(Math.exp(event.deltaY * 0.001));
  }, { passive: false });
  canvas.addEventListener("keydown", (event) => {
    const act = {
      ArrowLeft: () => turn(0.1, 0), ArrowRight: () => turn(-0.1, 0), ArrowUp: () => turn(0, 0.1),
      ArrowDown: () => turn(0, -0.1), "+": () => zoom(0.85), "-": () => zoom(1.18),
    }[event.key];
    if (act) { event.preventDefault(); act(); }
  });
  byId("in").addEventListener("click", () => zoom(0.8));
  byId("out").addEventListener("click", () => zoom(1.25));
  byId("reset").addEventListener("click", reset);
  byId("top").addEventListener("click", () => { see.azimuth = -Math.PI / 2; see.elevation = 1.5707; fit(); repaint(); });
  for (const name of ["outdoors", "before"]) byId(name)?.addEventListener("change", repaint);
  byId("room").addEventListener("change", (event) => { see.room = Number(event.target.value); renderer.sensorsChanged(); fit(); repaint(); });
  byId("storey")?.addEventListener("change", (event) => {
    see.storey = Number(event.target.value);
    byId("lift").disabled = see.storey < 0;
    renderer.sensorsChanged();
    fit();
    repaint();
  });
  byId("lift")?.addEventListener("change", () => { renderer.sensorsChanged(); fit(); repaint(); });
  byId("layer")?.addEventListener("change", (event) => {
    see.layer = Number(event.target.value);
    [...byId("scales").children].forEach((box, i) => { box.hidden = i !== see.layer; });
    renderer.sensorsChanged();
    repaint();
  });
  dark.addEventListener("change", repaint);
  new ResizeObserver(repaint).observe(canvas);
  renderer.sensorsChanged();
  reset();
  return { tint(colours) { tints = colours; repaint(); } };
};
if (document.getElementById("viewer-data")) cfsViewer(JSON.parse(document.getElementById("viewer-data").textContent));
