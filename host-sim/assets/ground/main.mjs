// The page of the ground station: what comes over the link goes into the map, the markers and the figures.

import { COLOURINGS, Cloud } from './cloud.mjs';
import { Link } from './link.mjs';
import { Markers } from './markers.mjs';
import { Panel } from './panel.mjs';
import { View } from './view.mjs';

const $ = (id) => document.getElementById(id);
const marks = document.body.dataset; // What scripts and tests read.

const cloud = new Cloud();
const view = new View($('view'), cloud);
marks.frames = view.frames;
view.afterFrame = (frames) => { marks.frames = frames; };
const markers = new Markers(view.things, $('labels'));
let clockAt = { station_s: 0, here_ms: performance.now() };
const clock = () => clockAt.station_s + (performance.now() - clockAt.here_ms) / 1000;
const panel = new Panel(clock, () => view.touch());
let session = null;
let fitted = 0;

view.beforeFrame = (...frame) => markers.beforeFrame(...frame);
view.followed = () => markers.place(panel.chosen);

// ---- What the station says ----

function setClock(now_s) { clockAt = { station_s: now_s, here_ms: performance.now() }; }

function bounds() {
  const [low, high] = [[...cloud.low], [...cloud.high]];
  for (const place of markers.places()) {
    place.toArray().forEach((value, axis) => {
      low[axis] = Math.min(low[axis], value);
      high[axis] = Math.max(high[axis], value);
    });
  }
  return [low, high];
}

/** Until a person takes the camera, it follows the map as that grows. */
function fitAsItGrows() {
  if (view.moved || view.mode !== 'orbit') return;
  const [low, high] = bounds();
  const size = Math.hypot(...high.map((h, axis) => h - low[axis]));
  if (Number.isFinite(size) && (fitted === 0 || size > 1.25 * fitted)) {
    fitted = size;
    view.fit([low, high]);
  }
}

function counted() {
  $('count').firstElementChild.textContent = cloud.total.toLocaleString('en').replaceAll(',', '\u202f');
  $('empty').hidden = cloud.total > 0 || panel.uavs.size > 0;
  marks.points = cloud.total;
  legend();
}

const on = {
  hello(hello) {
    setClock(hello.now_s);
    // A station that was started anew, or that sends everything again.
    cloud.clear();
    markers.clear();
    panel.clear();
    panel.staleAfter_s = hello.stale_after_s;
    if (session !== hello.session && hello.scene) scene();
    session = hello.session;
    marks.session = session;
    fitted = 0;
    counted();
    view.touch();
  },
  points(points) { cloud.take(points); counted(); fitAsItGrows(); view.touch(); },
  poses(poses) { setClock(poses.now_s); markers.poses(poses); panel.takePoses(poses); fitAsItGrows(); view.touch(); },
  trail(trail) { markers.trail(trail); view.touch(); },
  links(links) { panel.links(links); },
  status(status) {
    setClock(status.now_s);
    panel.take(status);
    marks.uavs = panel.uavs.size;
    $('empty').hidden = cloud.total > 0 || panel.uavs.size > 0;
  },
  state(state, text) {
    if (marks.link !== state) marks.link = state;
    const said = $('link').lastElementChild;
    if (said.textContent !== text) said.textContent = text;
    $('lost').hidden = state === 'live';
    if (state !== 'live') $('lost').textContent = state === 'lost' ? 'The station does not answer. What you see is old.' : 'Nothing comes from the station. What you see is old.';
  },
};

async function scene() {
  const edges = await (await fetch('/scene.json')).json();
  if (edges) view.setEdges(edges.edges);
}

// ---- What a person does ----

function setMode(mode) {
  if (mode !== 'orbit') view.moved = view.moved || mode === 'follow';
  view.setMode(mode);
  for (const button of $('camera').querySelectorAll('[data-mode]')) {
    button.setAttribute('aria-pressed', String(button.dataset.mode === mode));
  }
  marks.view = mode;
}

function setColour(name) {
  $('colour').value = name;
  cloud.colouring(name);
  legend();
  view.touch();
}

function legend() {
  const [low, gradient, high] = cloud.scale(marks.theme === 'dark');
  const [first, bar, last] = $('legend').children;
  first.textContent = low;
  last.textContent = high;
  if (bar.dataset.gradient !== gradient) {
    bar.dataset.gradient = gradient;
    bar.style.background = gradient;
  }
}

const systemDark = matchMedia('(prefers-color-scheme: dark)');

function setTheme(choice) {
  const dark = choice === 'dark' || (choice === 'auto' && systemDark.matches);
  try { localStorage.setItem('theme', choice); } catch { /* A browser may forbid it. */ }
  document.documentElement.dataset.theme = dark ? 'dark' : 'light';
  marks.theme = dark ? 'dark' : 'light';
  marks.themeChoice = choice;
  $('theme').textContent = `Theme: ${choice}`;
  const style = getComputedStyle(document.documentElement);
  const colour = (name) => style.getPropertyValue(name).trim();
  cloud.theme(dark);
  markers.theme(dark, colour('--gmt'));
  view.theme(colour('--bg'), colour('--grid'), colour('--scene'));
  panel.dark = dark;
  panel.show();
  legend();
}

function fit() { view.fit(bounds()); }

function nextColour() { setColour(COLOURINGS[(COLOURINGS.indexOf($('colour').value) + 1) % COLOURINGS.length]); }

for (const button of $('camera').querySelectorAll('[data-mode]')) {
  button.addEventListener('click', () => setMode(button.dataset.mode));
}
$('fit').addEventListener('click', fit);
$('colour').addEventListener('change', () => setColour($('colour').value));
$('theme').addEventListener('click', () => {
  const choices = ['auto', 'light', 'dark'];
  setTheme(choices[(choices.indexOf(marks.themeChoice) + 1) % choices.length]);
});
systemDark.addEventListener('change', () => setTheme(marks.themeChoice));

addEventListener('keydown', (event) => {
  if (event.ctrlKey || event.metaKey || event.altKey || event.target.closest('select, input')) return;
  const act = {
    o: () => setMode('orbit'), f: () => setMode('follow'), t: () => setMode('top'), Home: fit, c: nextColour, n: () => panel.next(),
  }[event.key];
  if (!act) return;
  act();
  event.preventDefault();
});

let choice = 'auto';
try { choice = localStorage.getItem('theme') ?? 'auto'; } catch { /* As the system says. */ }
setTheme(choice);
setColour('height');
setMode('orbit');

// Ages grow although nothing comes.
setInterval(() => {
  cloud.material.uniforms.now.value = clock();
  if ($('colour').value === 'age') view.touch();
}, 200);
setInterval(() => panel.show(), 1000);

new Link(on);
