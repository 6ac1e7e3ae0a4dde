// Draws the surfaces of RUN (webgl.py) and turns and plays them. Flat shading from screen-space derivatives, so no
// normals travel; positions are 16 bits of the box around everything.
(function () {
  const canvas = document.getElementById("view");
  const gl = canvas.getContext("webgl2", {antialias: true, preserveDrawingBuffer: true});
  const time = document.getElementById("time");
  if (!gl) {
    time.textContent = "this browser has no WebGL 2";
    return;
  }
  const bytes = (text) => Uint8Array.from(atob(text), (c) => c.charCodeAt(0));

  function shader(kind, source) {
    const made = gl.createShader(kind);
    gl.shaderSource(made, source);
    gl.compileShader(made);
    if (!gl.getShaderParameter(made, gl.COMPILE_STATUS)) throw new Error(gl.getShaderInfoLog(made));
    return made;
  }
  const program = gl.createProgram();
  gl.attachShader(program, shader(gl.VERTEX_SHADER, `#version 300 es
    in vec3 place; in float value; uniform mat4 camera; uniform vec3 low; uniform float span;
    out vec3 world; out float shown;
    void main() { world = low + span * place; shown = value; gl_Position = camera * vec4(world, 1.0); }`));
  gl.attachShader(program, shader(gl.FRAGMENT_SHADER, `#version 300 es
    precision highp float; in vec3 world; in float shown; uniform vec3 color, eye; uniform float valued;
    uniform vec3 map[17];
    out vec4 pixel;
    void main() {
      vec3 n = normalize(cross(dFdx(world), dFdy(world))), to = normalize(eye - world);
      if (dot(n, to) < 0.0) n = -n;
      float light = 0.45 + 0.35 * max(dot(n, normalize(vec3(0.4, -0.5, 0.8))), 0.0) + 0.25 * dot(n, to);
      float at = 16.0 * max(255.0 * shown - 1.0, 0.0) / 254.0;  // level 0: the body's own color
      int below = min(int(at), 15);
      vec3 of = mix(map[below], map[below + 1], at - float(below));
      pixel = vec4(light * mix(color, of, valued * min(255.0 * shown, 1.0)), 1.0);
    }`));
  gl.linkProgram(program);
  gl.useProgram(program);
  const at = (name) => gl.getUniformLocation(program, name);
  const places = {camera: at("camera"), low: at("low"), span: at("span"), color: at("color"), eye: at("eye"),
                  valued: at("valued"), map: at("map")};
  const place = gl.getAttribLocation(program, "place"), value = gl.getAttribLocation(program, "value");

  const buffer = (kind, data) => {
    const made = gl.createBuffer();
    gl.bindBuffer(kind, made);
    gl.bufferData(kind, data, gl.STATIC_DRAW);
    return made;
  };
  const surfaces = RUN.surfaces.map((s) => {
    const triangles = bytes(s.triangles);
    return {n: s.n, frames: s.frames, color: s.color, count: triangles.length / 4,
            points: buffer(gl.ARRAY_BUFFER, bytes(s.points)),
            values: s.values ? buffer(gl.ARRAY_BUFFER, bytes(s.values)) : null,
            triangles: buffer(gl.ELEMENT_ARRAY_BUFFER, triangles)};
  });

  // column-major 4 x 4; the camera looks from a sphere around the middle, z up
  let turn = -0.6, rise = 0.45, away = 2.2 * RUN.size;
  const middle = RUN.middle.slice();
  const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
  const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
  function axes() {
    const back = [Math.cos(rise) * Math.sin(turn + Math.PI), -Math.cos(rise) * Math.cos(turn), Math.sin(rise)];
    const length = Math.hypot(back[1], back[0]);
    const right = [-back[1] / length, back[0] / length, 0];
    return {back, right, up: cross(back, right), eye: middle.map((m, i) => m + away * back[i])};
  }
  function camera(view) {
    const {back, right, up, eye} = view;
    const near = 0.02 * away, far = 50 * away, f = 1 / Math.tan(Math.PI / 12);
    const a = (far + near) / (near - far), b = 2 * far * near / (near - far);
    const wide = f * canvas.height / canvas.width;
    const rows = [[...right, -dot(right, eye)], [...up, -dot(up, eye)], [...back, -dot(back, eye)]];
    const out = [];
    for (let c = 0; c < 4; ++c) out.push(wide * rows[0][c], f * rows[1][c], a * rows[2][c] + (c === 3 ? b : 0),
                                         -rows[2][c]);
    return out;
  }

  let frame = 0, playing = false;
  const slider = document.getElementById("at"), play = document.getElementById("play");
  slider.max = RUN.times.length - 1;
  function draw() {
    const dots = window.devicePixelRatio || 1;
    canvas.width = Math.max(1, Math.round(canvas.clientWidth * dots));
    canvas.height = Math.max(1, Math.round(canvas.clientHeight * dots));
    gl.viewport(0, 0, canvas.width, canvas.height);
    gl.clearColor(0.957, 0.961, 0.969, 1);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    gl.enable(gl.DEPTH_TEST);
    const view = axes();
    gl.uniformMatrix4fv(places.camera, false, camera(view));
    gl.uniform3fv(places.low, RUN.low);
    gl.uniform1f(places.span, RUN.span);
    gl.uniform3fv(places.eye, view.eye);
    gl.uniform3fv(places.map, RUN.map);
    for (const s of surfaces) {
      const shown = Math.min(frame, s.frames - 1);
      gl.uniform3fv(places.color, s.color);
      gl.uniform1f(places.valued, s.values ? 1 : 0);
      gl.bindBuffer(gl.ARRAY_BUFFER, s.points);
      gl.enableVertexAttribArray(place);
      gl.vertexAttribPointer(place, 3, gl.UNSIGNED_SHORT, true, 6, 6 * s.n * shown);
      if (s.values) {
        gl.bindBuffer(gl.ARRAY_BUFFER, s.values);
        gl.enableVertexAttribArray(value);
        gl.vertexAttribPointer(value, 1, gl.UNSIGNED_BYTE, true, 1, s.n * shown);
      } else {
        gl.disableVertexAttribArray(value);
        gl.vertexAttrib1f(value, 0);
      }
      gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, s.triangles);
      gl.drawElements(gl.TRIANGLES, s.count, gl.UNSIGNED_INT, 0);
    }
    slider.value = frame;
    time.textContent = "t = " + RUN.times[frame].toFixed(3) + " s";
  }

  let begun = 0, from = 0;
  function tick(now) {
    if (!playing) return;
    const t = RUN.times[from] + (now - begun) / 1000;
    while (frame + 1 < RUN.times.length && RUN.times[frame + 1] <= t) ++frame;
    draw();
    if (frame + 1 === RUN.times.length) stop();
    else requestAnimationFrame(tick);
  }
  function stop() {
    playing = false;
    play.textContent = "play";
  }
  play.onclick = () => {
    if (playing) return stop();
    playing = true;
    play.textContent = "pause";
    if (frame + 1 === RUN.times.length) frame = 0;
    from = frame;
    begun = performance.now();
    requestAnimationFrame(tick);
  };
  slider.oninput = () => {
    stop();
    frame = Number(slider.value);
    draw();
  };

  let held = null;
  canvas.onpointerdown = (e) => {
    held = [e.clientX, e.clientY];
    canvas.setPointerCapture(e.pointerId);
  };
  canvas.onpointerup = () => { held = null; };
  canvas.onpointermove = (e) => {
    if (!held) return;
    const dx = e.clientX - held[0], dy = e.clientY - held[1];
    held = [e.clientX, e.clientY];
    if (e.shiftKey) {
      const {right, up} = axes(), scale = 0.55 * away / canvas.clientHeight;
      for (let i = 0; i < 3; ++i) middle[i] += scale * (dy * up[i] - dx * right[i]);
    } else {
      turn += 0.008 * dx;
      rise = Math.max(-1.5, Math.min(1.5, rise + 0.008 * dy));
    }
    draw();
  };
  canvas.onwheel = (e) => {
    e.preventDefault();
    away *= Math.exp(0.001 * e.deltaY);
    draw();
  };
  window.onresize = draw;
  draw();
})();
