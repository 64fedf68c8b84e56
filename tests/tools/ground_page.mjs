// Drives the page of the ground station in a real browser. Called by tests/tests/ground as
// `node ground_page.mjs PLAYWRIGHT URL DIRECTORY`; asks for what is to happen by lines on standard output, goes on at a line on
// standard input, and ends with 0 only when everything was seen.

import { createInterface } from 'node:readline';
import { pathToFileURL } from 'node:url';
import { join } from 'node:path';

const [playwright, url, directory] = process.argv.slice(2);
const { chromium } = await import(pathToFileURL(join(playwright, 'index.mjs')).href);
const lines = createInterface({ input: process.stdin })[Symbol.asyncIterator]();
const PATIENCE_MS = 60_000;

/** Asks the test for something and waits until it is done. */
async function ask(what) {
  console.log(what);
  await lines.next();
}

function must(condition, message) {
  if (!condition) throw new Error(message);
}

const browser = await chromium.launch({
  executablePath: '/usr/bin/chromium',
  args: ['--no-sandbox', '--disable-dev-shm-usage', '--use-angle=swiftshader', '--enable-unsafe-swiftshader'],
});
const errors = [];

async function open(options) {
  const page = await browser.newPage(options);
  page.setDefaultTimeout(PATIENCE_MS);
  page.on('pageerror', (error) => errors.push(error.stack));
  page.on('console', (message) => {
    // While the station is away, that it is not there is no error of the page.
    const expected = message.text().includes('WebSocket connection to');
    if (message.type() === 'error' && !expected) errors.push(message.text());
  });
  page.on('request', (request) => {
    if (!request.url().startsWith(url) && !request.url().startsWith('data:')) errors.push(`asks ${request.url()}`);
  });
  await page.goto(url);
  return page;
}

const marks = (page) => page.evaluate(() => ({ ...document.body.dataset }));
const link = (page, state) => page.waitForFunction((s) => document.body.dataset.link === s, state);
const points = (page, more) => page.waitForFunction((n) => Number(document.body.dataset.points) > n, more);

/** Pixels of the view that differ from its corner; 0 when they are no more than `least`. Runs in the page. */
const pixelsAbove = (least) => {
  const canvas = document.getElementById('view');
  const gl = canvas.getContext('webgl2');
  const [w, h] = [gl.drawingBufferWidth, gl.drawingBufferHeight];
  const pixels = new Uint8Array(4 * w * h);
  gl.readPixels(0, 0, w, h, gl.RGBA, gl.UNSIGNED_BYTE, pixels);
  let count = 0;
  for (let k = 0; k < pixels.length; k += 4) {
    if (Math.abs(pixels[k] - pixels[0]) + Math.abs(pixels[k + 1] - pixels[1]) + Math.abs(pixels[k + 2] - pixels[2]) > 120) count += 1;
  }
  return count > least ? count : 0;
};
const drawn = (page) => page.evaluate(pixelsAbove, 0);
const drawnAbove = async (page, least) => (await page.waitForFunction(pixelsAbove, least)).jsonValue();

try {
  const page = await open({ viewport: { width: 1280, height: 800 }, colorScheme: 'light' });
  // 1. It loads, and says that nothing was heard.
  await link(page, 'live');
  must(await page.isVisible('#empty'), 'an empty station is shown as such');
  const before = await drawn(page);

  // 2. A flight: points on screen grow, and so do the figures.
  await ask('FLY');
  await points(page, 0);
  const first = await marks(page);
  await points(page, Number(first.points) + 1000);
  await page.waitForFunction(() => document.querySelectorAll('#uavs li').length === 3);
  // Markers and trails alone are less than a tenth of that.
  const after = await drawnAbove(page, before + 4000);
  console.error(`${after - before} pixels of the view show the flight`);
  must(await page.isHidden('#empty'), 'the map is not empty any more');
  must(await page.isVisible('#uavs li[data-state=live]'), 'a UAV is live');
  must((await page.textContent('#last-link')).includes('Sweep'), 'the last sweep is told in words');
  must((await page.textContent('#health')).includes('imu samples'), 'health counters are shown');
  must((await page.textContent('#packets')).includes('lost on the way'), 'losses are shown');
  await page.screenshot({ path: join(directory, 'light.png') });

  // 3. Views, colours and choice by keyboard alone.
  for (const [key, mode] of [['t', 'top'], ['f', 'follow'], ['o', 'orbit']]) {
    await page.keyboard.press(key);
    await page.waitForFunction((m) => document.body.dataset.view === m, mode);
  }
  await page.keyboard.press('c');
  must((await page.inputValue('#colour')) === 'age', 'C takes the next colour');
  await page.keyboard.press('n');
  must((await page.textContent('#one-title')) === 'UAV 2', 'N takes the next UAV');
  const frames = Number((await marks(page)).frames);
  await page.focus('#view');
  await page.keyboard.press('ArrowLeft');
  await page.waitForFunction((n) => Number(document.body.dataset.frames) > n, frames);
  await page.selectOption('#colour', 'gmt');
  await page.click('#theme');
  await page.click('#theme');
  must((await marks(page)).theme === 'dark', 'the theme can be chosen');

  // 4. The map as a file.
  const [download] = await Promise.all([page.waitForEvent('download'), page.click('#export')]);
  await download.saveAs(join(directory, 'map.ply'));

  // 5. The station goes away and comes back: the page says so, and comes back by itself.
  await ask('STOP');
  await link(page, 'lost');
  must(await page.isVisible('#lost'), 'a lost station is told');
  const session = (await marks(page)).session;
  await ask('START');
  await link(page, 'live');
  must((await marks(page)).session !== session, 'it is another run of the station');
  await points(page, 500);
  must(await page.isHidden('#lost'), 'it is not lost any more');

  // 6. Nothing comes from the UAVs any more: they are stale, the station is not.
  await ask('SILENCE');
  await page.waitForSelector('#uavs li[data-state=stale]');
  must((await marks(page)).link === 'live', 'the station itself is there');
  await ask('FLY');
  await page.waitForSelector('#uavs li[data-state=live]');

  // 7. The station hangs: the page says that what it shows is old.
  await ask('HANG');
  await link(page, 'stale');
  await ask('WAKE');
  await link(page, 'live');
  await page.close();

  // 8. Dark, and a phone: nothing is wider than the screen.
  for (const [name, width, height, colorScheme] of [['dark', 1280, 800, 'dark'], ['phone', 390, 844, 'light'], ['phone-dark', 390, 844, 'dark']]) {
    const other = await open({ viewport: { width, height }, colorScheme, hasTouch: width < 500 });
    await link(other, 'live');
    await points(other, 500);
    // Next to nothing is less.
    await drawnAbove(other, 500);
    const wide = await other.evaluate(() => document.documentElement.scrollWidth);
    must(wide <= width, `${name}: the page is ${wide} wide`);
    await other.screenshot({ path: join(directory, `${name}.png`) });
    if (width < 500) {
      await other.tap('#fold');
      must(await other.isVisible('#timeline'), `${name}: the figures open`);
      await other.evaluate(() => Promise.all(document.getAnimations().map((animation) => animation.finished)));
      await other.screenshot({ path: join(directory, `${name}-figures.png`) });
    }
    await other.close();
  }

  // 9. A million points.
  const big = await open({ viewport: { width: 1280, height: 800 } });
  await link(big, 'live');
  await ask('MILLION');
  const started = Date.now();
  await points(big, 999_999);
  console.error(`a million points on the page after ${((Date.now() - started) / 1000).toFixed(1)} s`);
  // Bytes that go to the graphics memory.
  await big.evaluate(() => {
    window.uploaded = 0;
    const gl = document.getElementById('view').getContext('webgl2');
    for (const name of ['bufferData', 'bufferSubData']) {
      const real = gl[name].bind(gl);
      gl[name] = (...args) => {
        const data = args[name === 'bufferData' ? 1 : 2];
        const count = args[name === 'bufferData' ? 3 : 4];
        if (data?.byteLength) window.uploaded += count ? count * data.BYTES_PER_ELEMENT : data.byteLength;
        return real(...args);
      };
    }
  });
  // Those of so many frames that show changes, each of which could upload the whole, and the time that they take, s.
  const uploads = (count) => big.evaluate((count) => new Promise((resolve) => {
    const frames = () => Number(document.body.dataset.frames);
    const [before, enough, begun] = [window.uploaded, frames() + count, performance.now()];
    const look = () => {
      const bytes = window.uploaded - before;
      if (bytes > 0 && frames() >= enough) resolve([bytes, (performance.now() - begun) / 1000]);
      else requestAnimationFrame(look);
    };
    look();
  }), count);
  // The million is uploaded once, over as many frames as its messages take. A page that goes on uploading the whole fails below.
  for (let frame = 0, calm = 0; frame < 60 && calm < 3; frame += 1) {
    const [bytes] = await uploads(1);
    calm = bytes < 1_000_000 ? calm + 1 : 0;
  }
  const [upload, seconds] = await uploads(8);
  console.error(`${upload} bytes uploaded in ${seconds.toFixed(1)} s of flight with a million points on the page`);
  // The UAVs fly in real time: a slow browser has fewer frames and more changes in each.
  must(upload < 1_000_000 * Math.max(seconds, 1), `changes upload ${upload} bytes: more than what has changed`);
  await big.close();
  must(errors.length === 0, errors.join('\n'));
  console.log('DONE');
} catch (error) {
  console.error(error.message, errors.join('\n'));
  process.exitCode = 1;
} finally {
  await browser.close();
  process.exit();
}
