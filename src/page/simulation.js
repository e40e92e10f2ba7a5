"use strict";
(() => {
  const data = JSON.parse(document.getElementById("motion").textContent);
  const canvas = document.getElementById("stage");
  const control = id => document.getElementById(id);
  const [play, slider, speed, said, turn, tilt] =
    ["play", "time", "speed", "now", "turn", "tilt"].map(control);
  const last = data.times.length - 1;
  const lasts = data.times[last] - data.times[0] || 1;
  // Places are whole numbers of a grid over the largest extent; a third one is across the picture.
  const spatial = data.axes.length === 3;
  const split = flat => {
    const all = [];
    for (let i = 0; i < flat.length; i += data.axes.length) all.push(flat.slice(i, i + data.axes.length));
    return all;
  };
  const places = data.frames.map(split);
  const obstacles = data.obstacles.map(own => ({lines: own.lines.map(split), moved: own.moved}));
  const middle = data.middle, paths = data.path;
  let now = data.times[0], playing = false, before = 0;

  function project(p) {
    const [x, y, z] = p.map((c, k) => c - middle[k]);
    if (!spatial) return [x, y];
    const a = turn.value * Math.PI / 180, b = tilt.value * Math.PI / 180;
    const across = x * Math.cos(a) + y * Math.sin(a), away = y * Math.cos(a) - x * Math.sin(a);
    return [across, z * Math.cos(b) + away * Math.sin(b)];
  }

  // The frame before a time, and the part of the way to the next.
  function between(times, t) {
    let low = 0, high = times.length - 1;
    while (high - low > 1) {
      const half = (low + high) >> 1;
      if (times[half] <= t) low = half; else high = half;
    }
    const part = high > low ? (t - times[low]) / (times[high] - times[low]) : 0;
    return [low, high, Math.min(1, Math.max(0, part))];
  }
  // Places of null separate the lines of several rods.
  const mix = (a, b, part) => a.map((x, k) => (x === null ? null : x + part * (b[k] - x)));

  function draw() {
    const dots = window.devicePixelRatio || 1, wide = canvas.clientWidth, high = canvas.clientHeight;
    if (!wide || !high) return;
    canvas.width = Math.round(wide * dots);
    canvas.height = Math.round(high * dots);
    const pen = canvas.getContext("2d"), style = getComputedStyle(document.documentElement);
    const color = name => style.getPropertyValue(name).trim();
    pen.scale(dots, dots);
    pen.lineJoin = pen.lineCap = "round";
    const room = 34, [extentX, extentY] = spatial ? [data.reach, data.reach] : data.extent;
    const zoom = Math.min((wide - 2 * room) / (extentX || 1), (high - 2 * room) / (extentY || 1));
    const at = p => {
      const [x, y] = project(p);
      return [wide / 2 + x * zoom, high / 2 - y * zoom];
    };
    const line = (points, ink, width, dash = []) => {
      pen.beginPath();
      let joined = false;
      for (const p of points) {
        if (p[0] !== null) joined ? pen.lineTo(...at(p)) : pen.moveTo(...at(p));
        joined = p[0] !== null;
      }
      pen.strokeStyle = ink;
      pen.lineWidth = width;
      pen.setLineDash(dash);
      pen.stroke();
    };
    line(places[0], color("--axis"), 1, [4, 4]);
    line(paths.places, color("--grid"), 1.5);
    const [low, high2, part] = between(data.times, now);
    const rod = places[low].map((p, i) => mix(p, places[high2][i], part));
    for (const {lines, moved} of obstacles) {
      const shift = moved.length ? mix(moved[low], moved[high2], part) : middle.map(() => 0);
      for (const own of lines) line(own.map(p => p.map((c, k) => c + shift[k])), color("--soft"), 1.5);
    }
    const been = between(paths.times, now);
    const tip = rod[rod.length - 1];
    line([...paths.places.slice(0, been[0] + 1), tip], color("--observed"), 1.5);
    line(rod, color("--model"), 3);
    pen.setLineDash([]);
    const [x, y] = at(tip);
    pen.beginPath();
    pen.arc(x, y, 4, 0, 7);
    pen.fillStyle = color("--model");
    pen.fill();
    // How long a length is, and where the axes point.
    const bar = data.bar.cells * zoom;
    pen.strokeStyle = pen.fillStyle = color("--soft");
    pen.lineWidth = 1.5;
    pen.font = "13px system-ui, sans-serif";
    pen.beginPath();
    pen.moveTo(12, high - 12);
    pen.lineTo(12 + bar, high - 12);
    pen.stroke();
    pen.fillText(data.bar.label, 12, high - 18);
    const [ox, oy] = [wide - 44, high - 34];
    data.axes.forEach((name, k) => {
      const tip = project(middle.map((c, i) => c + (i === k ? 1 : 0)));
      const [dx, dy] = [26 * tip[0] * data.signs[k], -26 * tip[1] * data.signs[k]];
      pen.beginPath();
      pen.moveTo(ox, oy);
      pen.lineTo(ox + dx, oy + dy);
      pen.stroke();
      if (Math.hypot(dx, dy) > 6) pen.fillText(name, ox + 1.35 * dx - 4, oy + 1.35 * dy + 4);
    });
    const place = mix(data.tips[been[0]], data.tips[been[1]], been[2]);
    said.textContent = `${number(now)} s, tip at (${place.map(c => c.toFixed(data.digits)).join(", ")}) m`;
    slider.value = Math.round(1000 * (now - data.times[0]) / lasts);
    slider.setAttribute("aria-valuetext", `${number(now)} seconds`);
  }
  const number = t => t.toFixed(Math.max(0, 3 - Math.floor(Math.log10(lasts))));

  function show(t) {
    now = Math.min(data.times[last], Math.max(data.times[0], t));
    draw();
  }
  function run(on) {
    playing = on;
    play.textContent = on ? "Pause" : "Play";
    if (!on) return;
    if (now >= data.times[last]) now = data.times[0];
    before = performance.now();
    requestAnimationFrame(tick);
  }
  function tick(at) {
    if (!playing) return;
    const passed = Math.max(0, at - before) / 1000;
    before = at;
    show(now + passed * speed.value);
    if (now >= data.times[last]) run(false);
    else requestAnimationFrame(tick);
  }
  play.addEventListener("click", () => run(!playing));
  slider.addEventListener("input", () => {
    run(false);
    show(data.times[0] + slider.value / 1000 * lasts);
  });
  if (spatial) {
    [turn, tilt].forEach(one => one.addEventListener("input", draw));
    canvas.addEventListener("pointerdown", event => canvas.setPointerCapture(event.pointerId));
    canvas.addEventListener("pointermove", event => {
      if (!canvas.hasPointerCapture(event.pointerId)) return;
      turn.value = (Number(turn.value) - event.movementX * 0.5 + 540) % 360 - 180;
      tilt.value = Number(tilt.value) + event.movementY * 0.5;
      draw();
    });
  }
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", draw);
  new ResizeObserver(draw).observe(canvas);
  draw();
})();
