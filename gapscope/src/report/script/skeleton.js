// The skeleton: turned by pointer and keys, moved through the log or a rollout. Points come from the program; see scene.rs.
const scene = data.scene;
const skeleton = document.getElementById("skeleton");
let pose = () => {};
if (scene && skeleton) {
  const rows = scene.points.map((row) => unpack(row, scene.step));
  const time = unpack(scene.time, 0.001);
  const joints = scene.joints.length;
  const moving = ([name, points]) => ({ name, rows: points.map((row) => unpack(row, scene.step)) });
  const plays = scene.plays.map((play) => ({ ...play, skeletons: play.skeletons.map(moving) }));
  // Center and size as in skeleton.rs, so that the picture does not jump when the script takes over.
  const low = [0, 0, 0], high = [0, 0, 0];
  const stands = [rows, ...plays.map((play) => play.skeletons[0].rows)];
  stands.forEach((rows) => rows.forEach((row, c) => row.forEach((x) => {
    low[c % 3] = Math.min(low[c % 3], x);
    high[c % 3] = Math.max(high[c % 3], x);
  })));
  const center = [0, 1].map((c) => 0.5 * (low[c] + high[c]));
  let yaw = -0.6, pitch = 0.3, frame = scene.still, playing = null, rolled = 0;
  // How far from the vertical and how high each point comes, the base among them.
  const places = [[Math.hypot(...center), 0]];
  stands.forEach((rows) => {
    for (let p = 0; p < rows.length; p += 3) rows[p].forEach((x, k) => places.push([Math.hypot(x - center[0], rows[p + 1][k] - center[1]), rows[p + 2][k]]));
  });
  let wide = 0, half = 1, rise = 0;
  const fit = () => {
    const [sin, cos] = [Math.abs(Math.sin(pitch)), Math.cos(pitch)];
    let down = 0, up = 0;
    places.forEach(([away, z]) => {
      wide = Math.max(wide, away);
      down = Math.min(down, z * cos - away * sin);
      up = Math.max(up, z * cos + away * sin);
    });
    down = Math.min(down, -sin * (0.35 * wide + Math.hypot(...center)));
    half = 1.1 * Math.max(wide, 0.5 * (up - down)) || 1;
    rise = 0.5 * (up + down);
  };
  fit();

  const project = ([x, y, z]) => {
    const p = [x - center[0], y - center[1]];
    const away = p[0] * Math.sin(yaw) + p[1] * Math.cos(yaw);
    return [(p[0] * Math.cos(yaw) - p[1] * Math.sin(yaw)) / half, (rise - z * Math.cos(pitch) - away * Math.sin(pitch)) / half, away / half];
  };
  const at = (rows, k) => {
    const list = [], from = Math.floor(k), part = k - from, to = Math.min(from + 1, rows[0].length - 1);
    for (let c = 0; c < rows.length; c += 3) {
      list.push([0, 1, 2].map((i) => rows[c + i][from] * (1 - part) + rows[c + i][to] * part));
    }
    return list;
  };
  const middle = (points, j) => points[2 * j].map((x, c) => 0.5 * (x + points[2 * j + 1][c]));
  const segments = (points) => {
    const list = [];
    for (let j = 0; j < joints; j++) {
      list.push([scene.parents[j] < 0 ? [0, 0, 0] : middle(points, scene.parents[j]), middle(points, j)]);
    }
    scene.tips.forEach((j, k) => list.push([middle(points, j), points[2 * joints + k]]));
    return list;
  };
  const place = (line, [from, to]) => {
    const [a, b] = [project(from), project(to)];
    line.setAttribute("x1", a[0].toFixed(3));
    line.setAttribute("y1", a[1].toFixed(3));
    line.setAttribute("x2", b[0].toFixed(3));
    line.setAttribute("y2", b[1].toFixed(3));
    line.style.opacity = (0.85 - 0.3 * Math.max(-1, Math.min(1, 0.5 * (a[2] + b[2])))).toFixed(2);
  };
  const links = skeleton.querySelectorAll(".links line");
  const groups = skeleton.querySelectorAll(".joint");
  const numbers = skeleton.querySelectorAll(".labels text");
  const leaders = skeleton.querySelectorAll(".labels .leader");
  // As in skeleton.rs.
  const BESIDE = [[0.05, -0.04], [-0.11, -0.04], [0.05, 0.1], [-0.11, 0.1], [0.18, 0.03], [-0.24, 0.03], [0.05, -0.18], [-0.11, -0.18]];
  const APART = [0.12, 0.12];
  const floor = skeleton.querySelector(".floor");
  const ghosts = skeleton.querySelector(".ghosts");

  const draw = () => {
    const play = plays.find((play) => play.name === playing), robot = play && play.skeletons[0].rows;
    const points = play ? at(robot, Math.min(rolled, robot[0].length - 1)) : at(rows, frame);
    segments(points).forEach((segment, i) => place(links[i], segment));
    groups.forEach((group, j) => {
      const ends = [points[2 * j], points[2 * j + 1]];
      place(group.querySelector(".barrel"), ends);
    });
    const placed = [];
    numbers.forEach((text, j) => {
      const [x, y] = project(points[2 * j + 1]), places = BESIDE.map(([dx, dy]) => [x + dx, y + dy]);
      const free = ([x, y]) => Math.abs(y) <= 0.92 && placed.every((o) => Math.abs(x - o[0]) >= APART[0] || Math.abs(y - o[1]) >= APART[1]);
      const place = places.find(free) ?? places[0];
      placed.push(place);
      text.setAttribute("x", place[0].toFixed(3));
      text.setAttribute("y", place[1].toFixed(3));
      const right = place[0] > x, far = Math.abs(place[0] - x) > (right ? 0.06 : 0.12) || Math.abs(place[1] - y) > 0.11;
      const ends = { x1: x, y1: y, x2: far ? place[0] + (right ? -0.02 : 0.08) : x, y2: far ? place[1] - 0.02 : y };
      Object.entries(ends).forEach(([name, value]) => leaders[j].setAttribute(name, value.toFixed(3)));
    });
    const ring = [];
    for (let k = 0; k <= 48; k++) {
      const angle = 2 * Math.PI * k / 48;
      ring.push(project([0.35 * wide * Math.cos(angle), 0.35 * wide * Math.sin(angle), 0]).slice(0, 2).map((x) => x.toFixed(3)));
    }
    floor.setAttribute("points", ring.join(" "));
    ghosts.replaceChildren(...(play ? play.skeletons.slice(1).flatMap(ghost) : []));
  };
  const ghost = ({ name, rows }) => {
    const end = rows[0].length - 1;
    return segments(at(rows, Math.min(rolled, end))).map((segment) => {
      const line = document.createElementNS("http://www.w3.org/2000/svg", "line");
      line.setAttribute("class", "ghost " + name);
      place(line, segment);
      return line;
    });
  };

  // What shows a moment of the log, for the chart's pointer.
  pose = (t) => {
    if (playing) return;
    let k = time.findIndex((x) => x > t);
    k = k < 0 ? time.length - 1 : Math.max(0, k - 1);
    const span = time[k + 1] - time[k];
    frame = k + (span > 0 ? Math.min(1, (t - time[k]) / span) : 0);
    draw();
  };

  let held = null, turned = false;
  skeleton.addEventListener("pointerdown", (event) => {
    held = [event.clientX, event.clientY, yaw, pitch];
    turned = false;
  });
  window.addEventListener("pointermove", (event) => {
    if (!held) return;
    const [x, y, yaw0, pitch0] = held;
    if (Math.hypot(event.clientX - x, event.clientY - y) > 4) turned = true;
    if (!turned) return;
    yaw = yaw0 - (event.clientX - x) * 0.01;
    pitch = Math.max(-1.5, Math.min(1.5, pitch0 + (event.clientY - y) * 0.01));
    fit();
    draw();
  });
  window.addEventListener("pointerup", () => {
    held = null;
    // The click that ends a turn is none; the next one is.
    setTimeout(() => { turned = false; });
  });
  window.addEventListener("pointercancel", () => { held = null; });
  skeleton.addEventListener("keydown", (event) => {
    const turn = { ArrowLeft: [0.12, 0], ArrowRight: [-0.12, 0], ArrowUp: [0, 0.12], ArrowDown: [0, -0.12] }[event.key];
    if (!turn) return;
    event.preventDefault();
    yaw += turn[0];
    pitch = Math.max(-1.5, Math.min(1.5, pitch + turn[1]));
    fit();
    draw();
  });
  groups.forEach((group, j) => {
    ["pointerenter", "focus"].forEach((event) => group.addEventListener(event, () => numbers[j].classList.add("shown")));
    ["pointerleave", "blur"].forEach((event) => group.addEventListener(event, () => numbers[j].classList.remove("shown")));
    group.setAttribute("tabindex", "0");
    group.setAttribute("role", "button");
    group.setAttribute("aria-label", "Show " + group.dataset.joint + " only");
    group.addEventListener("click", () => { if (!turned) pick(group.dataset.joint); });
    group.addEventListener("keydown", (event) => {
      if (event.key !== "Enter" && event.key !== " ") return;
      event.preventDefault();
      pick(group.dataset.joint);
    });
  });

  const buttons = document.querySelectorAll("[data-play]");
  const labels = new Map([...buttons].map((button) => [button, button.textContent]));
  const stop = () => {
    playing = null;
    buttons.forEach((button) => { button.textContent = labels.get(button); });
    document.querySelector(".rollout-key").hidden = true;
    draw();
  };
  buttons.forEach((button) => button.addEventListener("click", () => {
    if (playing) {
      stop();
      return;
    }
    playing = button.dataset.play;
    buttons.forEach((other) => { if (other.dataset.play === playing) other.textContent = "Stop"; });
    // The button may stand far from the robot that it moves.
    const seen = skeleton.getBoundingClientRect();
    if (seen.bottom < 0.5 * seen.height || seen.top > innerHeight - 0.5 * seen.height) skeleton.scrollIntoView({ block: "center" });
    const play = plays.find((play) => play.name === playing);
    document.querySelector(".rollout-key").hidden = !play || play.skeletons.length < 2;
    const short = (x) => String(Number(x.toPrecision(2)));
    if (play) document.querySelector(".pace").textContent = short(play.length) + " s" + (play.pace < 0.95 ? ", " + short(1 / play.pace) + " times slower" : "");
    const start = performance.now(), first = frame >= time.length - 1 ? 0 : frame, t0 = time[Math.floor(first)];
    let k = Math.floor(first);
    const step = (now) => {
      if (playing !== button.dataset.play) return;
      const seconds = Math.max(0, now - start) / 1000;
      if (play) {
        // After the end the last moment stays for a while, then all begins anew.
        rolled = (seconds * play.pace / play.length % 1.15) * (play.skeletons[0].rows[0].length - 1);
      } else {
        while (k < time.length - 1 && time[k + 1] <= t0 + seconds) k++;
        if (k >= time.length - 1) {
          frame = time.length - 1;
          stop();
          return;
        }
        frame = k + Math.min(1, (t0 + seconds - time[k]) / (time[k + 1] - time[k]));
        follow(time[k] + (frame - k) * (time[k + 1] - time[k]));
      }
      draw();
      requestAnimationFrame(step);
    };
    requestAnimationFrame(step);
  }));
  draw();
}
