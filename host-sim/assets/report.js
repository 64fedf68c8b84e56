(() => {
  "use strict";
  const data = JSON.parse(document.getElementById("flight").textContent);
  const canvas = document.getElementById("view");
  const shown = {};
  let draw = () => {};
  for (const box of document.querySelectorAll("[data-layer]")) {
    const apply = () => {
      shown[box.dataset.layer] = box.checked;
      document.body.classList.toggle("hide-" + box.dataset.layer, !box.checked);
      draw();
    };
    box.addEventListener("change", apply);
    apply();
  }
  const gl = canvas.getContext("webgl", { antialias: true, alpha: false, preserveDrawingBuffer: true });
  if (!gl) {
    canvas.hidden = true;
    document.getElementById("no-view").hidden = false;
    document.body.dataset.view = "none";
    return;
  }

  // One program: coloured, shaded by a normal where there is one; points are discs.
  const VERTEX = `attribute vec3 place; attribute vec3 normal; attribute vec3 colour;
    uniform mat4 view; uniform float size; varying vec3 tint;
    void main() {
      gl_Position = view * vec4(place, 1.0);
      gl_PointSize = size;
      float light = dot(normal, normal) > 0.5 ? 0.82 + 0.2 * dot(normal, vec3(0.45, -0.35, 0.82)) : 1.0;
      tint = colour * light;
    }`;
  const FRAGMENT = `precision mediump float; varying vec3 tint; uniform bool disc; uniform float alpha;
    void main() {
      if (disc && length(gl_PointCoord - 0.5) > 0.5) discard;
      gl_FragColor = vec4(tint, alpha);
    }`;
  const compile = (kind, text) => {
    const shader = gl.createShader(kind);
    gl.shaderSource(shader, text);
    gl.compileShader(shader);
    return shader;
  };
  const program = gl.createProgram();
  gl.attachShader(program, compile(gl.VERTEX_SHADER, VERTEX));
  gl.attachShader(program, compile(gl.FRAGMENT_SHADER, FRAGMENT));
  gl.linkProgram(program);
  gl.useProgram(program);
  const at = (name) => gl.getUniformLocation(program, name);
  const uniform = { view: at("view"), size: at("size"), disc: at("disc"), alpha: at("alpha") };

  // Centimetres from the middle of the scene, as units of half its width.
  const [cx, cy, cz, half] = data.centre;
  const unit = (values, stride = 3) => {
    const out = [];
    for (let i = 0; i + 2 < values.length; i += stride) {
      out.push((values[i] - cx) / half, (values[i + 1] - cy) / half, (values[i + 2] - cz) / half);
    }
    return out;
  };
  const normalsOf = (p) => {
    const out = [];
    for (let i = 0; i < p.length; i += 9) {
      const a = [p[i + 3] - p[i], p[i + 4] - p[i + 1], p[i + 5] - p[i + 2]];
      const b = [p[i + 6] - p[i], p[i + 7] - p[i + 1], p[i + 8] - p[i + 2]];
      const n = [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
      const length = Math.hypot(...n) || 1;
      for (let k = 0; k < 3; k++) out.push(n[0] / length, n[1] / length, n[2] / length);
    }
    return out;
  };
  const segments = (p) => {
    const out = [];
    for (let i = 3; i < p.length; i += 3) {
      const d = Math.hypot(p[i] - p[i - 3], p[i + 1] - p[i - 2], p[i + 2] - p[i - 1]) * half;
      // Path lists jump: no line across more than 6 m.
      if (d < 600) out.push(p[i - 3], p[i - 2], p[i - 1], p[i], p[i + 1], p[i + 2]);
    }
    return out;
  };
  const buffer = (values) => {
    const made = gl.createBuffer();
    gl.bindBuffer(gl.ARRAY_BUFFER, made);
    gl.bufferData(gl.ARRAY_BUFFER, new Float32Array(values), gl.STATIC_DRAW);
    return made;
  };
  const thing = (layer, mode, places, colour, size, normals) => ({
    layer, mode, colour, size, count: places.length / 3,
    places: buffer(places), normals: normals ? buffer(normals) : null,
  });
  // The ground, so that buildings stand out: level triangles within 0.3 m of the lowest corner.
  const lowest = data.triangles.reduce((low, v, i) => (i % 3 === 2 ? Math.min(low, v) : low), Infinity);
  const [flat, raised] = [[], []];
  for (let i = 0; i < data.triangles.length; i += 9) {
    const corner = data.triangles.slice(i, i + 9);
    ([2, 5, 8].every((k) => corner[k] < lowest + 30) ? flat : raised).push(...corner);
  }
  const [ground, faces] = [unit(flat), unit(raised)];
  const byClass = (k) => {
    const some = [];
    for (let i = 0; i < data.map.length; i += 4) {
      if (data.map[i + 3] === k) some.push(data.map[i], data.map[i + 1], data.map[i + 2]);
    }
    return unit(some);
  };
  const things = [
    thing("surfaces", gl.TRIANGLES, ground, "--ground", 1),
    thing("surfaces", gl.TRIANGLES, faces, "--solid", 1, normalsOf(faces)),
    thing("surfaces", gl.LINES, unit(data.edges), "--wall", 1),
    thing("vertices", gl.POINTS, unit(data.vertices), "--vertex", 5),
    thing("map", gl.POINTS, byClass(0), "--ok", 4.5),
    thing("map", gl.POINTS, byClass(1), "--warn", 5),
    thing("map", gl.POINTS, byClass(2), "--bad", 6),
    thing("truth", gl.LINES, segments(unit(data.truth)), "--truth", 1),
    thing("estimate", gl.LINES, segments(unit(data.estimate)), "--est", 1),
    // Lines are one pixel wide everywhere: points thicken them.
    thing("truth", gl.POINTS, unit(data.truth), "--truth", 1.6),
    thing("estimate", gl.POINTS, unit(data.estimate), "--est", 2.6),
    thing("gmt", gl.LINES, segments(unit(data.gmt)), "--gmt", 1),
    thing("gmt", gl.POINTS, unit(data.gmt), "--gmt", 5),
  ];

  const colourOf = (name) => {
    const hex = getComputedStyle(document.documentElement).getPropertyValue(name).trim().slice(1);
    const full = hex.length === 3 ? [...hex].map((c) => c + c).join("") : hex;
    return [0, 2, 4].map((i) => parseInt(full.slice(i, i + 2), 16) / 255);
  };

  const START = { turn: -0.6, tilt: 0.85, away: 2.2, x: 0, y: 0, z: 0 };
  const eye = { ...START };
  const matrix = (aspect) => {
    // Perspective times a look from `away` at the target, turned about z and tilted.
    const [st, ct, sp, cp] = [Math.sin(eye.turn), Math.cos(eye.turn), Math.sin(eye.tilt), Math.cos(eye.tilt)];
    const right = [ct, st, 0];
    const back = [st * cp, -ct * cp, sp];
    const up = [-st * sp, ct * sp, cp];
    const near = 0.02, far = 20, f = 2.2;
    const rows = [right, up, back].map((r) => [...r, -(r[0] * eye.x + r[1] * eye.y + r[2] * eye.z)]);
    rows[2][3] -= eye.away;
    const [fx, fy] = aspect > 1 ? [f / aspect, f] : [f, f * aspect];
    const a = (far + near) / (near - far), b = (2 * far * near) / (near - far);
    const clip = [
      rows[0].map((v) => v * fx),
      rows[1].map((v) => v * fy),
      rows[2].map((v, k) => v * a + (k === 3 ? b : 0)),
      rows[2].map((v) => -v),
    ];
    return new Float32Array([0, 1, 2, 3].flatMap((column) => clip.map((row) => row[column])));
  };

  let waiting = false;
  draw = () => {
    if (waiting) return;
    waiting = true;
    requestAnimationFrame(paint);
  };
  const paint = () => {
    waiting = false;
    const ratio = window.devicePixelRatio || 1;
    const [width, height] = [canvas.clientWidth, canvas.clientHeight].map((v) => Math.max(1, Math.round(v * ratio)));
    if (canvas.width !== width || canvas.height !== height) [canvas.width, canvas.height] = [width, height];
    gl.viewport(0, 0, width, height);
    gl.clearColor(...colourOf("--panel"), 1);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    gl.enable(gl.DEPTH_TEST);
    gl.depthFunc(gl.LEQUAL);
    gl.uniformMatrix4fv(uniform.view, false, matrix(width / height));
    for (const item of things) {
      if (!shown[item.layer] || item.count === 0) continue;
      const solid = item.mode === gl.TRIANGLES;
      // Walls seen from behind are left out: one looks into rooms. Solid faces step back behind what lies on them.
      (solid ? gl.enable : gl.disable).call(gl, gl.CULL_FACE);
      (solid ? gl.enable : gl.disable).call(gl, gl.POLYGON_OFFSET_FILL);
      gl.polygonOffset(2, 4);
      const array = (name, source, fixed) => {
        const slot = gl.getAttribLocation(program, name);
        if (slot < 0) return;
        if (source) {
          gl.bindBuffer(gl.ARRAY_BUFFER, source);
          gl.enableVertexAttribArray(slot);
          gl.vertexAttribPointer(slot, 3, gl.FLOAT, false, 0, 0);
        } else {
          gl.disableVertexAttribArray(slot);
          gl.vertexAttrib3fv(slot, fixed);
        }
      };
      array("place", item.places);
      array("normal", item.normals, [0, 0, 0]);
      array("colour", null, colourOf(item.colour));
      gl.uniform1f(uniform.size, item.size * ratio);
      gl.uniform1i(uniform.disc, item.mode === gl.POINTS ? 1 : 0);
      gl.uniform1f(uniform.alpha, 1);
      gl.drawArrays(item.mode, 0, item.count);
    }
    document.body.dataset.view = gl.getError() === gl.NO_ERROR ? "drawn" : "failed";
  };

  const clamp = (value, low, high) => Math.min(high, Math.max(low, value));
  const turn = (dx, dy) => {
    eye.turn -= dx;
    eye.tilt = clamp(eye.tilt + dy, 0.02, Math.PI / 2);
    draw();
  };
  const zoom = (factor) => {
    eye.away = clamp(eye.away * factor, 0.1, 8);
    draw();
  };
  const move = (dx, dy) => {
    const [s, c] = [Math.sin(eye.turn), Math.cos(eye.turn)];
    eye.x -= (c * dx - s * dy) * eye.away;
    eye.y -= (s * dx + c * dy) * eye.away;
    draw();
  };
  const pointers = new Map();
  canvas.addEventListener("pointerdown", (e) => {
    canvas.setPointerCapture(e.pointerId);
    pointers.set(e.pointerId, e);
  });
  for (const end of ["pointerup", "pointercancel"]) canvas.addEventListener(end, (e) => pointers.delete(e.pointerId));
  canvas.addEventListener("pointermove", (e) => {
    const before = pointers.get(e.pointerId);
    if (!before) return;
    const [dx, dy] = [(e.clientX - before.clientX) / canvas.clientWidth, (e.clientY - before.clientY) / canvas.clientHeight];
    const other = [...pointers.values()].find((p) => p.pointerId !== e.pointerId);
    pointers.set(e.pointerId, e);
    if (other) {
      const span = (p) => Math.hypot(p.clientX - other.clientX, p.clientY - other.clientY) || 1;
      zoom(span(before) / span(e));
    } else if (e.shiftKey || e.buttons === 2 || e.buttons === 4) {
      move(dx, -dy);
    } else {
      turn(dx * 4, dy * 3);
    }
  });
  canvas.addEventListener("contextmenu", (e) => e.preventDefault());
  canvas.addEventListener("wheel", (e) => {
    // The page scrolls unless the view has been chosen.
    if (document.activeElement !== canvas) return;
    e.preventDefault();
    zoom(Math.exp(clamp(e.deltaY, -100, 100) * 0.002));
  }, { passive: false });
  canvas.addEventListener("keydown", (e) => {
    const arrow = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] }[e.key];
    if (arrow && e.shiftKey) move(-arrow[0] * 0.05, -arrow[1] * 0.05);
    else if (arrow) turn(arrow[0] * 0.1, arrow[1] * 0.08);
    else if (e.key === "+" || e.key === "=") zoom(0.85);
    else if (e.key === "-" || e.key === "_") zoom(1 / 0.85);
    else if (e.key === "Home" || e.key === "0") { Object.assign(eye, START); draw(); }
    else return;
    e.preventDefault();
  });
  new ResizeObserver(draw).observe(canvas);
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", draw);
  draw();
})();
