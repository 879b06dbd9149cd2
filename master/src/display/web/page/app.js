"use strict";

// The page of rayfarm. It receives pictures and the state over one WebSocket, and sends movements and commands.

const $ = (id) => document.getElementById(id);
const COLORS = ["#6cb6ff", "#5b6570", "#b48ef0", "#e58fc0", "#f0b35a", "#7c8590", "#8fd19e"];
const RETRY_MS = [300, 700, 1500, 3000, 5000];
const CHART_POINTS = 120;
const MAX_LOG_LINES = 500;
/// Notches of a wheel per pixel, line and page of scrolling.
const NOTCHES = [1 / 100, 1 / 3, 1];
const MAX_SECONDS = 0.25;

const page = {
  socket: null, retries: 0, facts: null, client: 0, owner: false, steering: {}, status: null,
  nextCommand: 1, replies: new Map(), shown: 0, exact: false,
};

// --- connection ---

function connect() {
  const url = new URL("ws", location.href);
  url.protocol = url.protocol === "https:" ? "wss:" : "ws:";
  const socket = new WebSocket(url);
  socket.binaryType = "arraybuffer";
  page.socket = socket;
  socket.onmessage = ({ data }) => {
    if (typeof data === "string") receive(JSON.parse(data));
    else showPicture(socket, data);
  };
  socket.onclose = () => {
    page.replies.clear();
    held.clear();
    notice("The connection to the master is lost. Connecting again …");
    $("figures").textContent = "not connected";
    document.body.dataset.connected = "false";
    const wait = RETRY_MS[Math.min(page.retries, RETRY_MS.length - 1)];
    page.retries += 1;
    setTimeout(connect, wait);
  };
}

function send(message) {
  if (page.socket && page.socket.readyState === WebSocket.OPEN) page.socket.send(JSON.stringify(message));
}

function command(line) {
  return new Promise((resolve) => {
    if (!page.socket || page.socket.readyState !== WebSocket.OPEN) {
      resolve({ ok: false, error: "not connected" });
      return;
    }
    const id = page.nextCommand++;
    page.replies.set(id, resolve);
    send({ type: "command", id, line });
  });
}

// Sends a command of a button and shows why it is refused.
async function order(line) {
  const reply = await command(line);
  if (!reply.ok) notice(reply.error, 6000);
}

const RECEIVERS = {
  hello(message) {
    Object.assign(page, { facts: message, client: message.client, owner: message.owner, retries: 0 });
    document.body.dataset.connected = "true";
    document.title = `${message.scene} – rayfarm`;
    $("scene").textContent = message.scene;
    $("scene").title = `${message.triangles.toLocaleString("en")} triangles, rayfarm ${message.version}`;
    notice("");
    $("log").textContent = "";
    $("log-panel").hidden = !message.owner;
    $("join").hidden = !message.join;
    $("join-line").textContent = message.join ? message.join[0] : "";
    makeLegend(message.parts);
    makeOptions(message.options);
    if (document.hidden) send({ type: "visible", visible: false });
  },
  status({ status }) {
    page.status = status;
    showStatus(status);
  },
  steering({ steering }) {
    page.steering = steering;
    const steers = steering.steers === page.client;
    $("steer").hidden = steers;
    $("steer").disabled = steering.requests === page.client;
    $("steer").textContent = steering.requests === page.client ? "Requested" : "Request to steer";
    $("handover").hidden = !(steers && steering.requests !== null);
    $("handover-text").textContent = `Page ${steering.requests} requests to steer.`;
    for (const field of $("options").elements) field.disabled = !steers;
    if (page.status) showFigures(page.status);
  },
  reply({ id, reply }) {
    const resolve = page.replies.get(id);
    page.replies.delete(id);
    if (resolve) resolve(reply);
  },
  log({ lines }) {
    const log = $("log");
    const follows = log.scrollTop + log.clientHeight >= log.scrollHeight - 4;
    const all = (log.textContent ? log.textContent.split("\n") : []).concat(lines);
    log.textContent = all.slice(-MAX_LOG_LINES).join("\n");
    if (follows) log.scrollTop = log.scrollHeight;
  },
  busy() {
    notice("The view has too many movements to apply; some were dropped.", 3000);
  },
};

function receive(message) {
  const receiver = RECEIVERS[message.type];
  if (receiver) receiver(message);
}

let noticeTimer = 0;
function notice(text, milliseconds) {
  clearTimeout(noticeTimer);
  noticeTimer = 0;
  $("notice").textContent = text;
  $("notice").hidden = !text;
  if (milliseconds) noticeTimer = setTimeout(() => notice(page.status?.view.problem ?? ""), milliseconds);
}

// --- picture ---

async function showPicture(socket, data) {
  const header = new DataView(data, 0, 16);
  const [kind, number] = [header.getUint8(0), header.getUint32(4, true)];
  const type = kind === 2 ? "image/png" : "image/jpeg";
  const blob = new Blob([new Uint8Array(data, 16)], { type });
  try {
    // The bytes of the picture without conversion to the colour space of a screen.
    const bitmap = await createImageBitmap(blob, { colorSpaceConversion: "none", premultiplyAlpha: "none" });
    const canvas = $("picture");
    if (canvas.width !== bitmap.width || canvas.height !== bitmap.height) {
      canvas.width = bitmap.width;
      canvas.height = bitmap.height;
    }
    canvas.getContext("2d", { alpha: false }).drawImage(bitmap, 0, 0);
    bitmap.close();
    page.shown += 1;
    page.exact = kind === 2;
    canvas.dataset.shown = page.shown;
    canvas.dataset.exact = page.exact;
  } finally {
    if (socket === page.socket) send({ type: "shown", picture: number });
  }
}

document.addEventListener("visibilitychange", () => send({ type: "visible", visible: !document.hidden }));

// --- input ---

const held = new Set();
let drag = [0, 0];
let wheel = 0;
let moves = [];
let lastTick = 0;
let ticking = false;

function tick(now) {
  const seconds = Math.min((now - lastTick) / 1000, MAX_SECONDS);
  lastTick = now;
  const axis = (plus, minus) => Number(plus.some((key) => held.has(key))) - Number(minus.some((key) => held.has(key)));
  const fly = [axis(["d"], ["a"]), axis(["e"], ["q"]), axis(["w"], ["s"])];
  if (fly.some(Boolean)) moves.push({ fly: [...fly, seconds] });
  const look = [axis(["arrowright"], ["arrowleft"]), axis(["arrowup"], ["arrowdown"])];
  if (look.some(Boolean)) moves.push({ look: [...look, seconds] });
  const roll = axis(["."], [","]);
  if (roll) moves.push({ roll: [roll, seconds] });
  const magnify = axis(["+", "=", "pageup"], ["-", "pagedown"]);
  if (magnify) moves.push({ magnify: [magnify, seconds] });
  if (drag[0] || drag[1]) moves.push({ orbit: drag });
  if (wheel) moves.push({ zoom: wheel });
  drag = [0, 0];
  wheel = 0;
  if (moves.length) send({ type: "input", moves: moves.slice(0, 16) });
  moves = [];
  ticking = held.size > 0 && steers();
  if (ticking) requestAnimationFrame(tick);
}

// Sends input with the next frame of the screen, and repeats this while a key is held.
function schedule() {
  if (!steers()) {
    if (page.steering.steers) notice(`Page ${page.steering.steers} steers. Request to steer first.`, 3000);
    moves = [];
    drag = [0, 0];
    wheel = 0;
    return;
  }
  if (ticking) return;
  ticking = true;
  lastTick = performance.now();
  requestAnimationFrame(tick);
}

function steers() {
  return page.steering.steers === page.client;
}

const HELD = new Set(["w", "a", "s", "d", "e", "q", "arrowup", "arrowdown", "arrowleft", "arrowright", ",", ".", "+", "=", "-", "pageup", "pagedown"]);
const PRESSED = {
  r() { moves.push("reset"); schedule(); },
  p() { pauseAll(); },
  h() { toggleHelp(); },
  f() { document.body.classList.toggle("no-panels"); },
};

addEventListener("keydown", (event) => {
  if (event.ctrlKey || event.metaKey || event.altKey || event.target.closest("input, select, pre, summary, button, a")) return;
  const key = event.key.toLowerCase();
  if (HELD.has(key)) {
    event.preventDefault();
    if (!held.has(key)) {
      held.add(key);
      schedule();
    }
  } else if (Object.hasOwn(PRESSED, key) && !event.repeat) {
    event.preventDefault();
    PRESSED[key]();
  }
});
addEventListener("keyup", (event) => held.delete(event.key.toLowerCase()));
addEventListener("blur", () => held.clear());

// Fingers and mouse buttons that are down, by pointer.
const pointers = new Map();
const canvas = $("picture");

// Height of the picture as it is shown, without the bars next to it.
function shownHeight() {
  const box = canvas.getBoundingClientRect();
  return Math.max(1, Math.min(box.height, box.width * canvas.height / canvas.width));
}

function spread() {
  const [a, b] = [...pointers.values()];
  return Math.hypot(a.x - b.x, a.y - b.y);
}

canvas.addEventListener("pointerdown", (event) => {
  if (event.button !== 0) return;
  canvas.focus({ preventScroll: true });
  canvas.setPointerCapture(event.pointerId);
  canvas.classList.add("dragging");
  pointers.set(event.pointerId, { x: event.clientX, y: event.clientY });
});
canvas.addEventListener("pointermove", (event) => {
  const from = pointers.get(event.pointerId);
  if (!from) return;
  const before = pointers.size === 2 ? spread() : 0;
  const to = { x: event.clientX, y: event.clientY };
  pointers.set(event.pointerId, to);
  if (pointers.size === 1) {
    drag[0] += (to.x - from.x) / shownHeight();
    drag[1] += (to.y - from.y) / shownHeight();
  } else if (pointers.size === 2 && before > 0) {
    wheel += 6 * Math.log2(Math.max(spread(), 1) / before);
  }
  schedule();
});
for (const type of ["pointerup", "pointercancel", "lostpointercapture"]) {
  canvas.addEventListener(type, (event) => {
    pointers.delete(event.pointerId);
    canvas.classList.toggle("dragging", pointers.size > 0);
  });
}
canvas.addEventListener("wheel", (event) => {
  event.preventDefault();
  wheel -= event.deltaY * NOTCHES[event.deltaMode];
  schedule();
}, { passive: false });

// --- figures ---

function milliseconds(seconds) {
  const ms = seconds * 1000;
  return ms < 10 ? ms.toFixed(1) : ms.toFixed(0);
}

function showFigures({ view, farm, workers }) {
  const parts = [];
  if (view.width) parts.push(`${view.width} × ${view.height}`);
  if (view.film) {
    const error = view.film.error === null ? "" : `, error ${(view.film.error * 100).toFixed(1)} %`;
    parts.push(`${view.film.samples} of ${view.film.of} samples${error}${view.film.denoised ? ", denoised" : ""}`);
  }
  parts.push(view.at_rest ? "at rest" : `${view.fps.toFixed(1)} fps`);
  parts.push(`${milliseconds(view.frame_seconds)} ms`);
  parts.push(`${workers.length} ${workers.length === 1 ? "worker" : "workers"}, ${farm.threads} threads`);
  if (page.steering.clients > 1) parts.push(steers() ? "you steer" : `page ${page.steering.steers} steers`);
  $("figures").textContent = parts.join("  ·  ");
}

function showStatus(status) {
  showFigures(status);
  const { view } = status;
  if (view.problem) notice(view.problem);
  else if (status.workers.length === 0) notice("Waiting for a worker.");
  else if (!$("notice").hidden && !noticeTimer) notice("");
  if (!view.at_rest) {
    fpsChart.add(view.fps);
    latencyChart.add(view.latency_seconds === null ? null : view.latency_seconds * 1000);
  }
  $("fps-now").textContent = view.at_rest ? "at rest" : view.fps.toFixed(1);
  $("latency-now").textContent = view.latency_seconds === null ? "–" : milliseconds(view.latency_seconds);
  showWorkers(status);
  showOptions(status.options ?? {});
}

class Chart {
  constructor(id, color) {
    Object.assign(this, { canvas: $(id), color, values: [] });
  }

  add(value) {
    this.values.push(value);
    if (this.values.length > CHART_POINTS) this.values.shift();
    this.draw();
  }

  draw() {
    const ratio = devicePixelRatio || 1;
    const [width, height] = [this.canvas.clientWidth, this.canvas.clientHeight];
    this.canvas.width = width * ratio;
    this.canvas.height = height * ratio;
    const context = this.canvas.getContext("2d");
    context.scale(ratio, ratio);
    const known = this.values.filter((value) => value !== null);
    const top = niceTop(Math.max(1, ...known));
    context.fillStyle = "#a3adb8";
    context.font = "10px system-ui, sans-serif";
    context.fillText(String(top), 4, 11);
    context.strokeStyle = this.color;
    context.lineWidth = 1.5;
    context.beginPath();
    let draws = false;
    this.values.forEach((value, index) => {
      if (value === null) {
        draws = false;
        return;
      }
      const x = width * (1 - (this.values.length - 1 - index) / (CHART_POINTS - 1));
      const y = height - 2 - (height - 6) * value / top;
      if (draws) context.lineTo(x, y);
      else context.moveTo(x, y);
      draws = true;
    });
    context.stroke();
  }
}

// The smallest of 1, 2, 5, 10, 20, ... that is not below a value.
function niceTop(value) {
  const power = 10 ** Math.floor(Math.log10(value));
  return [1, 2, 5, 10].map((step) => step * power).find((step) => step >= value);
}

const fpsChart = new Chart("fps-chart", "#6cb6ff");
const latencyChart = new Chart("latency-chart", "#f0b35a");
addEventListener("resize", () => { fpsChart.draw(); latencyChart.draw(); });

// --- workers ---

function element(name, attributes = {}, ...children) {
  const made = Object.assign(document.createElement(name), attributes);
  made.append(...children);
  return made;
}

function makeLegend(parts) {
  $("legend").replaceChildren(...parts.map((part, index) => {
    const square = element("i");
    square.style.background = COLORS[index % COLORS.length];
    return element("span", {}, square, part.replace("_", " "));
  }));
}

const rows = new Map();

function showWorkers({ workers, kicked }) {
  $("worker-count").textContent = workers.length ? `${workers.length}` : "none";
  const paused = workers.length > 0 && workers.every((worker) => worker.state === "paused");
  $("pause-all").textContent = paused ? "Resume all" : "Pause all";
  $("pause-all").disabled = !page.owner || workers.length === 0;
  const present = new Set(workers.map((worker) => worker.id));
  for (const [id, row] of rows) {
    if (!present.has(id)) {
      row.item.remove();
      rows.delete(id);
    }
  }
  for (const worker of workers) {
    if (!rows.has(worker.id)) rows.set(worker.id, makeRow(worker));
    showRow(rows.get(worker.id), worker);
  }
  const items = kicked.map((worker) => {
    const allow = element("button", { type: "button", textContent: "Allow", disabled: !page.owner });
    allow.onclick = () => order(`allow ${worker.id}`);
    return element("li", {}, element("span", { textContent: `${worker.name}, kicked` }), allow);
  });
  $("kicked").replaceChildren(...items);
}

function makeRow(worker) {
  const button = (text, line) => {
    const made = element("button", { type: "button", textContent: text, disabled: !page.owner });
    made.onclick = () => order(line());
    return made;
  };
  const row = { id: worker.id, state: "" };
  row.name = element("span", { className: "name" });
  row.pause = button("Pause", () => `${row.state === "paused" ? "resume" : "pause"} ${worker.id}`);
  row.drain = button("Drain", () => `drain ${worker.id}`);
  row.kick = button("Kick", () => `kick ${worker.id}`);
  row.kick.className = "kick";
  row.parts = element("canvas", { className: "parts" });
  row.facts = element("small");
  row.trouble = element("div", { className: "trouble" });
  const first = element("div", { className: "row" }, row.name, row.pause, row.drain, row.kick);
  row.item = element("li", {}, first, row.parts, row.facts, row.trouble);
  row.item.dataset.worker = worker.id;
  $("workers").append(row.item);
  return row;
}

function showRow(row, worker) {
  if (row.state !== worker.state) {
    row.state = worker.state;
    const state = element("span", { className: `state-${worker.state}`, textContent: worker.state });
    row.name.replaceChildren(`${worker.name} `, state);
    row.name.title = `${worker.name}, number ${worker.id}, ${worker.address}`;
    row.pause.textContent = worker.state === "paused" ? "Resume" : "Pause";
  }
  const speed = Math.round(worker.rows_per_second).toLocaleString("en");
  const facts = `${worker.threads} ${worker.threads === 1 ? "thread" : "threads"} · ${speed} rows/s · ${worker.segments_done.toLocaleString("en")} segments`;
  if (row.facts.textContent !== facts) row.facts.textContent = facts;
  row.trouble.textContent = worker.trouble ?? "";
  const shares = JSON.stringify(worker.thread_time_percent);
  if (row.shares !== shares) {
    row.shares = shares;
    drawParts(row.parts, worker.thread_time_percent);
  }
}

function drawParts(canvas, percents) {
  const parts = Object.entries(percents ?? {});
  canvas.title = parts.map(([name, percent]) => `${name.replace("_", " ")} ${percent} %`).join(", ");
  canvas.width = Math.max(1, canvas.clientWidth);
  canvas.height = Math.max(1, canvas.clientHeight);
  const context = canvas.getContext("2d");
  const names = page.facts.parts;
  let from = 0;
  for (const [name, percent] of parts) {
    const width = percent / 100 * canvas.width;
    context.fillStyle = COLORS[names.indexOf(name) % COLORS.length];
    context.fillRect(from, 0, width, canvas.height);
    from += width;
  }
}

function pauseAll() {
  const workers = page.status?.workers ?? [];
  if (workers.length) order(workers.every((worker) => worker.state === "paused") ? "resume" : "pause");
}

// --- options ---

function makeOptions(options) {
  const fields = options.flatMap(({ option, summary, words, range }) => {
    const field = range
      ? element("input", { type: "number", min: range.least, max: range.most, step: range.whole ? 1 : "any" })
      : element("select", {}, ...words.map((word) => element("option", { value: word, textContent: word })));
    field.id = `option-${option}`;
    field.name = option;
    field.onchange = () => setOption(field);
    field.onblur = () => setTimeout(() => page.status && showOptions(page.status.options ?? {}), 700);
    const label = element("label", { htmlFor: field.id, textContent: option.replaceAll("-", " "), title: summary });
    field.title = summary;
    return [label, field];
  });
  const denoise = element("select", { id: "option-denoise", name: "denoise", title: "Filter the noise of paths in the picture at rest." });
  denoise.append(...["", "on", "off"].map((word) => element("option", { value: word, textContent: word })));
  denoise.onchange = () => denoise.value && setOption(denoise);
  const label = element("label", { htmlFor: "option-denoise", textContent: "denoise" });
  $("options").replaceChildren(...fields, label, denoise, element("p", { className: "refused", id: "option-refused" }));
}

async function setOption(field) {
  const reply = await command(`set ${field.name} ${field.value}`);
  $("option-refused").textContent = reply.ok ? "" : reply.error;
  // A value that the scene does not allow is not applied: then the field shows the old one again.
  setTimeout(() => page.status && showOptions(page.status.options ?? {}), reply.ok ? 700 : 0);
}

function showOptions(options) {
  for (const { option } of page.facts.options) {
    const field = $(`option-${option}`);
    const applies = Object.hasOwn(options, option);
    field.hidden = !applies;
    field.labels[0].hidden = !applies;
    if (!applies || field === document.activeElement) continue;
    const value = options[option];
    field.value = typeof value === "number" ? String(Number(value.toPrecision(6))) : value ?? "";
  }
  const paths = page.facts.options.some(({ option }) => option === "sampler" && Object.hasOwn(options, "sampler"));
  $("option-denoise").hidden = !paths;
  $("option-denoise").labels[0].hidden = !paths;
}

$("options").addEventListener("submit", (event) => event.preventDefault());

// --- buttons ---

function toggleHelp() {
  const help = $("help");
  help.hidden = !help.hidden;
  $("help-button").setAttribute("aria-expanded", String(!help.hidden));
}

async function copyJoinLine() {
  const line = $("join-line");
  try {
    await navigator.clipboard.writeText(line.textContent);
  } catch {
    // Without a secure connection there is no clipboard: the selected text can be copied by hand.
    getSelection().selectAllChildren(line);
    if (!document.execCommand("copy")) return;
  }
  $("copy").textContent = "Copied";
  setTimeout(() => { $("copy").textContent = "Copy"; }, 1500);
}

$("help-button").onclick = toggleHelp;
$("copy").onclick = copyJoinLine;
$("pause-all").onclick = pauseAll;
$("steer").onclick = () => send({ type: "steer" });
$("grant").onclick = () => send({ type: "handover", grant: true });
$("refuse").onclick = () => send({ type: "handover", grant: false });
$("command").addEventListener("submit", async (event) => {
  event.preventDefault();
  const line = $("command-line").value.trim() || "help";
  $("reply").textContent = JSON.stringify(await command(line), null, 1);
  $("command-line").value = "";
});

connect();
