// Torque or position of one joint over time: measured, nominal, corrected; zoom, pan, readout. The words come with the data.
let show = () => {}, follow = () => {};
const live = document.getElementById("live");
if (live && data.series.length && window.uPlot) {
  const words = data.words;
  const color = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();
  const select = live.querySelector("select"), box = live.querySelector(".chart"), readout = live.querySelector("output");
  const series = data.series.map((s) => {
    const values = { ...s, t: unpack(s.t, 0.001), m: unpack(s.m, s.step), n: unpack(s.n, s.step), c: unpack(s.c, s.step) };
    // A new episode begins: no line joins the two.
    s.breaks.forEach((k) => [values.m, values.n, values.c].forEach((row) => { if (row.length) row[k] = null; }));
    return values;
  });
  let chart = null, errors = null, current = series[0], moving = false;
  const figure = (x) => x == null ? "–" : (Math.abs(x) >= 100 ? x.toFixed(0) : Math.abs(x) >= 1 ? x.toFixed(2) : x.toPrecision(2)).replace("-", "−");
  const say = () => {
    const k = chart.cursor.idx;
    if (k == null) {
      readout.textContent = "Point at the curve, or use the arrow keys, to read it.";
      return;
    }
    const { t, m, n, c, unit } = current;
    const parts = ["t " + t[k].toFixed(2) + " s", "measured " + figure(m[k]), words.nominal + " " + figure(n[k])];
    if (c.length) parts.push(words.corrected + " " + figure(c[k]));
    parts.push("gap " + figure(m[k] == null ? null : m[k] - n[k]) + (c.length ? " → " + figure(m[k] == null ? null : m[k] - c[k]) : "") + " " + unit);
    readout.textContent = parts.join(" · ");
  };
  // A true minus sign, and no more digits than ticks need.
  const signed = (_, ticks) => ticks.map((x) => x == null ? "" : String(Number(x.toPrecision(6))).replace("-", "−"));
  const options = () => {
    const ink = color("--muted"), grid = color("--grid"), font = "12px system-ui, sans-serif";
    const axis = { stroke: ink, grid: { stroke: grid, width: 1 }, ticks: { stroke: grid, width: 1 }, font, labelFont: font, labelSize: 18, values: signed };
    const list = [{}, { label: "measured", stroke: color("--measured-line"), width: 2.5 }, { label: words.nominal, stroke: color("--before"), width: 1.4 }];
    if (current.c.length) list.push({ label: words.corrected, stroke: color("--after"), width: 1.4, dash: [6, 3] });
    const shade = color("--shade");
    return {
      width: box.clientWidth, height: tall(),
      legend: { show: false }, cursor: { drag: { x: true, y: false }, focus: { prox: 24 }, sync: { key: "time" } },
      scales: { x: { time: false } }, series: list,
      bands: [{ series: [1, 2], fill: shade }, { series: [2, 1], fill: shade }],
      axes: [{ ...axis, size: 8, values: () => [] }, { ...axis, label: words.what + ", " + current.unit, size: 56, space: 24 }],
      hooks: { setCursor: [() => { say(); if (chart.cursor.idx != null) pose(current.t[chart.cursor.idx]); }], setScale: [same] },
    };
  };
  // What the models leave of what was measured: a gap of a newton metre shows beside none of sixty.
  const below = () => {
    const { series: lines, axes, bands: _, hooks: __, ...rest } = options();
    return {
      ...rest, height: low(), series: [{}, ...lines.slice(2).map((line, i) => ({ ...line, fill: i ? undefined : color("--shade") }))],
      axes: [{ ...axes[1], scale: "x", side: 2, label: "time, s", size: 46, space: 50 }, { ...axes[1], label: "gap, " + current.unit, space: 18 }], hooks: { setScale: [same] },
    };
  };
  const tall = () => Math.max(160, Math.min(190, box.clientWidth * 0.35)), low = () => Math.max(150, Math.min(160, box.clientWidth * 0.25));
  const same = (one, key) => {
    if (key !== "x" || moving || !chart || !errors) return;
    moving = true;
    const { min, max } = one.scales.x;
    (one === chart ? errors : chart).setScale("x", { min, max });
    moving = false;
  };
  const make = () => {
    const range = chart && [chart.scales.x.min, chart.scales.x.max];
    [chart, errors].forEach((one) => one && one.destroy());
    chart = errors = null;
    const rows = [current.t, current.m, current.n];
    if (current.c.length) rows.push(current.c);
    chart = new uPlot(options(), rows, box);
    errors = new uPlot(below(), [rows[0], ...rows.slice(2).map((row) => row.map((x, k) => x == null ? null : rows[1][k] - x))], box);
    box.querySelectorAll("canvas").forEach((canvas) => canvas.setAttribute("aria-hidden", "true"));
    if (range && range[0] != null) chart.setScale("x", { min: range[0], max: range[1] });
    say();
  };
  const zoom = (factor, shift = 0) => {
    const { min, max } = chart.scales.x, ends = [current.t[0], current.t[current.t.length - 1]];
    const middle = chart.cursor.idx != null && !shift ? current.t[chart.cursor.idx] : 0.5 * (min + max);
    const width = Math.min((max - min) * factor, ends[1] - ends[0]), part = (middle - min) / (max - min);
    let from = (shift ? min : middle - part * width) + shift * width;
    from = Math.max(ends[0], Math.min(from, ends[1] - width));
    chart.setScale("x", { min: from, max: from + width });
    box.dataset.from = from.toFixed(3);
    box.dataset.to = (from + width).toFixed(3);
  };
  const acts = {
    in: () => zoom(0.5), out: () => zoom(2), left: () => zoom(1, -0.25), right: () => zoom(1, 0.25),
    all: () => { const t = current.t; chart.setScale("x", { min: t[0], max: t[t.length - 1] }); delete box.dataset.from; },
  };
  const move = (by) => {
    const { min, max } = chart.scales.x, t = current.t;
    let k = chart.cursor.idx == null ? t.findIndex((x) => x >= 0.5 * (min + max)) : chart.cursor.idx + by;
    k = Math.max(0, Math.min(t.length - 1, k));
    chart.setCursor({ left: chart.valToPos(t[k], "x"), top: chart.valToPos(current.m[k] ?? 0, "y") });
  };
  live.querySelectorAll("[data-zoom]").forEach((button) => button.addEventListener("click", () => acts[button.dataset.zoom]()));
  box.addEventListener("keydown", (event) => {
    const act = {
      "+": acts.in, "=": acts.in, "-": acts.out, "0": acts.all, Home: acts.all, Escape: acts.all,
      ArrowLeft: () => event.shiftKey ? acts.left() : move(-1), ArrowRight: () => event.shiftKey ? acts.right() : move(1),
    }[event.key];
    if (!act) return;
    event.preventDefault();
    act();
  });
  box.addEventListener("wheel", (event) => {
    if (!event.ctrlKey) return;
    event.preventDefault();
    zoom(event.deltaY < 0 ? 0.8 : 1.25);
  }, { passive: false });
  show = (joint) => {
    const found = series.find((s) => s.joint === joint);
    if (!found) return;
    current = found;
    select.value = joint;
    make();
    document.querySelectorAll("[data-still]").forEach((still) => { still.hidden = true; });
  };
  follow = (t) => {
    const { min, max } = chart.scales.x;
    if (t >= min && t <= max) chart.setCursor({ left: chart.valToPos(t, "x"), top: 10 });
  };
  select.addEventListener("change", () => show(select.value));
  live.hidden = false;
  show(select.value);
  new ResizeObserver(() => {
    if (box.clientWidth && Math.abs(box.clientWidth - chart.width) > 1) {
      chart.setSize({ width: box.clientWidth, height: tall() });
      errors.setSize({ width: box.clientWidth, height: low() });
    }
  }).observe(box);
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", make);
}
